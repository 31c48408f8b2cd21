// Rows into a file through OpenImageIO: what the format can hold, its windows, its tiles.
#ifndef TESSERA_IO_FILE_SINK_H_
#define TESSERA_IO_FILE_SINK_H_

#include <OpenImageIO/imageio.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/digest.h"
#include "graph/source.h"
#include "io/codec/codec.h"
#include "io/output_file.h"
#include "io/read_back.h"
#include "tessera/image.h"
#include "tessera/io.h"

namespace tessera::io {

class FileSink final : public graph::RowSink {
 public:
  // Judges what can be judged before a file exists; `shown` names it in errors and its extension is the
  // format. Throws Error for an unknown extension and for channels that the format cannot hold.
  FileSink(const std::string& shown, const ImageSpec& spec, PixelType type,
           const std::vector<Attribute>& attributes);
  ~FileSink() override;

  // Opens the existing, empty file. Throws Error.
  void Open(const std::string& temporary, Codec codec = Codec::kOpenImageIO, int threads = 1);
  // The same for a file of several images, by the first's sink; the others, in order, go on where the one
  // before them has finished. Only formats that hold several.
  void OpenFirst(const std::string& temporary, const std::vector<FileSink*>& all);
  void OpenBehind(FileSink& before);
  bool HoldsSeveral() const { return output_->supports("multiimage"); }
  std::string Format() const { return output_->format_name(); }
  // The type that Write takes: the one asked for, or the nearest that the format has. Known after Open.
  PixelType type() const { return type_; }
  // That type before Open, where the format has no other.
  std::optional<PixelType> OnlyType() const;

  void Write(const ConstImageView& rows) override;
  int RowGranularity() const override { return granularity_; }
  // Writes what is missing below the last row and closes. Throws Error when not everything reached the disk.
  void Finish();
  // Who encodes, and why not somebody faster. Known after Open.
  const std::string& encoder() const { return encoder_text_; }
  // Where the pixels are in the finished file.
  FileLayout Layout() const;

 private:
  void ChooseChannels(const ImageSpec& spec);
  void ChooseWindow(const ImageSpec& spec);
  void ChooseTypes(const std::vector<std::string>& types);
  void ChooseTiles(const ImageSpec& spec, const std::vector<Attribute>& attributes);
  bool OpenEncoder(int threads);
  void OpenStream();
  void Opened(bool ok);
  void Pad(int until);
  void Put(int y0, int y1, const std::byte* data, ptrdiff_t row_stride);
  bool Compares() const;
  void Note(int rows, const std::byte* data, ptrdiff_t row_stride);
  void PutTiles(int y0, int y1, const std::byte* data, ptrdiff_t row_stride);
  void Mend();
  void CheckReadable();
  bool KeepsBits() const;
  void CheckPart() const;
  [[noreturn]] void Fail(const std::string& message) const;

  std::string shown_, temporary_;
  std::shared_ptr<CheckedFile> stream_;  // null for formats that open files themselves; outlives output_
  std::shared_ptr<OIIO::ImageOutput> output_;
  int part_ = 0;                        // of the file's images
  bool several_ = false;                // as there are others
  std::vector<const FileSink*> parts_;  // all of several, for the last
  bool closes_ = true;                  // as no other image follows
  std::unique_ptr<Encoder> encoder_;    // in place of output_, which is not opened then
  base::Digest digest_{};               // of what was written, where that is compared
  std::vector<std::byte> last_column_;
  std::string encoder_text_;
  OIIO::ImageSpec file_spec_;
  Roi data_;               // window of the rows that Write is given
  Roi window_;             // the part that the file holds, same coordinates
  std::vector<int> kept_;  // channels that the file holds
  bool direct_ = true;     // rows go to the file as they are
  int next_ = 0;           // first row of window_ that is not written
  PixelType type_;
  int granularity_ = 1;
  std::vector<std::byte> composed_, tile_rows_;
  int tile_top_ = 0;  // tile_rows_ holds [tile_top_, next_)
};

}  // namespace tessera::io

#endif  // TESSERA_IO_FILE_SINK_H_
