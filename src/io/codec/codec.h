// Fast ways to and from the files of the day. OpenImageIO stays the library of formats: a codec is taken
// where it keeps the promise "same pixels, same metadata, readable by everyone", and says why where it does
// not.
#ifndef TESSERA_IO_CODEC_CODEC_H_
#define TESSERA_IO_CODEC_CODEC_H_

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cstddef>
#include <memory>
#include <string>

#include "tessera/image.h"

namespace tessera::io {

// What an attempt to take a codec found: it, or why not.
template <typename Codec>
struct Choice {
  std::unique_ptr<Codec> codec{};
  std::string why_not{};
  std::string by{};  // whose code it calls, where that is worth telling
};

// Rows of a file's channels [first, last), which are given when it is made.
class Decoder {
 public:
  virtual ~Decoder() = default;
  // As graph::RowReader.
  virtual void Limit(int threads, size_t memory) = 0;
  // As graph::RowReader, but false for whatever is not as expected: OpenImageIO is asked then, and is the
  // judge.
  virtual bool Read(const ImageView& out) = 0;
  // Why the last one was false.
  const char* reason() const { return reason_; }

 protected:
  bool RefuseMemory() {
    reason_ = "its pixels take more memory than is allowed";
    return false;
  }

 private:
  const char* reason_ = "its pixels are not as expected";
};

// Rows into a file.
class Encoder {
 public:
  virtual ~Encoder() = default;
  // The spec as OpenImageIO's own writer would have made it of the one given.
  const OIIO::ImageSpec& spec() const { return spec_; }
  // The next rows, interleaved and packed, of the spec's type.
  virtual void Write(int rows, const std::byte* data, ptrdiff_t row_stride) = 0;
  // What is left, after the last row. Failures of the stream are for its owner to ask.
  virtual void Finish() = 0;

 protected:
  OIIO::ImageSpec spec_;
};

// How a file's pixels may be decoded; `spec` is OpenImageIO's. Looks at the file's header alone.
Choice<Decoder> MakeDecoder(const std::string& format, const std::string& file, int part,
                            const OIIO::ImageSpec& spec, int first, int last);
// How pixels may be written to `stream`, which outlives the encoder and has a file of its name to itself.
Choice<Encoder> MakeEncoder(const std::string& format, const OIIO::ImageSpec& spec,
                            OIIO::Filesystem::IOProxy& stream, int threads);

// Who does it, for --explain and --runstats.
template <typename Codec>
std::string CodecText(const std::string& format, const Choice<Codec>& choice) {
  if (!choice.codec) return "OpenImageIO (" + choice.why_not + ")";
  return "the codec " + format + (choice.by.empty() ? "" : " (" + choice.by + ")");
}

// One per format.
Choice<Decoder> MakeExrDecoder(const std::string& file, int part, const OIIO::ImageSpec& spec, int first,
                               int last);
Choice<Encoder> MakeExrEncoder(const OIIO::ImageSpec& spec, OIIO::Filesystem::IOProxy& stream, int threads);
Choice<Decoder> MakeJpegDecoder(const std::string& file, int part, const OIIO::ImageSpec& spec, int first,
                                int last);
Choice<Decoder> MakePngDecoder(const std::string& file, int part, const OIIO::ImageSpec& spec, int first,
                               int last);
Choice<Encoder> MakePngEncoder(const OIIO::ImageSpec& spec, OIIO::Filesystem::IOProxy& stream, int threads);
Choice<Decoder> MakeTiffDecoder(const std::string& file, int part, const OIIO::ImageSpec& spec, int first,
                                int last);
Choice<Encoder> MakeTiffEncoder(const OIIO::ImageSpec& spec, OIIO::Filesystem::IOProxy& stream, int threads);

}  // namespace tessera::io

#endif  // TESSERA_IO_CODEC_CODEC_H_
