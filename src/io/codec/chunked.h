// Files whose rows are packed in chunks that do not depend on each other: which chunks a read needs, and what
// is kept of one for the next.
#ifndef TESSERA_IO_CODEC_CHUNKED_H_
#define TESSERA_IO_CODEC_CHUNKED_H_

#include <cstddef>
#include <cstdint>

#include "base/bytes.h"
#include "io/codec/codec.h"

namespace tessera::io {

class ChunkedDecoder : public Decoder {
 public:
  void Limit(int threads, size_t memory) override;
  bool Read(const ImageView& out) final;

 protected:
  // `rows`: of a chunk; `row`: bytes of an unpacked row.
  ChunkedDecoder(const OIIO::ImageSpec& spec, int rows, size_t row) : spec_(spec), rows_(rows), row_(row) {}

  int Top(int chunk) const { return spec_.y + chunk * rows_; }
  int Height(int chunk) const;
  size_t Bytes(int chunk) const { return row_ * static_cast<size_t>(Height(chunk)); }
  const OIIO::ImageSpec& spec() const { return spec_; }

  // Before any chunk is unpacked.
  virtual void Prepare(int workers) = 0;
  // The rows of a chunk, which stay until the worker's next; null for what is not as expected. Workers call
  // at once.
  virtual const uint8_t* Unpack(int chunk, int worker) = 0;
  // A row of them as pixels.
  virtual void PutRow(const uint8_t* row, std::byte* pixels, ptrdiff_t pixel_stride) const = 0;

 private:
  bool ReadChunk(int chunk, bool last, int worker, const ImageView& out);

  const OIIO::ImageSpec spec_;
  const int rows_;
  const size_t row_;
  int threads_ = 1;
  size_t memory_ = size_t{1} << 28;
  bool prepared_ = false;
  base::Bytes kept_, next_;  // the chunk that was asked for in part
  int kept_chunk_ = -1, next_chunk_ = -1;
};

}  // namespace tessera::io

#endif  // TESSERA_IO_CODEC_CHUNKED_H_
