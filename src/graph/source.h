// Where pixels come from and go to, as the engine sees it: memory, or rows streamed in file order.
#ifndef TESSERA_GRAPH_SOURCE_H_
#define TESSERA_GRAPH_SOURCE_H_

#include <memory>
#include <optional>
#include <string>

#include "graph/op.h"
#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera::graph {

// Reads rows of some channels. One thread at a time uses a reader; rows are asked for in ascending order and
// never twice, so a reader may be sequential.
class RowReader {
 public:
  virtual ~RowReader() = default;
  // Fills `out` (roi: full data window width, rows [y0,y1); interleaved, the reader's channels, spec().type).
  virtual void Read(const ImageView& out) = 0;
  // Before the first Read: how many threads it may use, and the bytes that it may hold.
  virtual void Limit(int threads, size_t memory) { (void)threads, (void)memory; }
};

class PixelSource {
 public:
  virtual ~PixelSource() = default;
  virtual const ImageSpec& spec() const = 0;
  virtual std::string Describe() const = 0;  // the file's name, or "memory"
  // The pixels, when they are resident.
  virtual std::optional<ConstImageView> View() const { return std::nullopt; }
  // Bytes after the last of those pixels that may be read.
  virtual ptrdiff_t ReadMargin() const { return 0; }
  // A reader of channels [first, last); throws Error. Only called when View() is empty.
  virtual std::unique_ptr<RowReader> Open(int first, int last) const {
    (void)first, (void)last;
    return nullptr;
  }
  // Who decodes the pixels, and why not somebody faster; empty for memory.
  virtual std::string Decoder() const { return ""; }
  // Rows that are cheap to read together (tile height, compression chunk); 1 when it does not matter.
  virtual int RowGranularity() const { return 1; }
};

// The op of a source node.
class SourceOp final : public Op {
 public:
  explicit SourceOp(std::shared_ptr<const PixelSource> source) : source_(std::move(source)) {}
  std::string Name() const override { return "source"; }
  OpKind Kind() const override { return OpKind::kSource; }
  const std::any& Parameters() const override { return none_; }
  ImageSpec OutputSpec(std::span<const ImageSpec>) const override { return source_->spec(); }
  std::string Describe() const override { return source_->Describe(); }
  const PixelSource& source() const { return *source_; }

 private:
  std::shared_ptr<const PixelSource> source_;
  std::any none_;
};

Node MakeSource(std::shared_ptr<const PixelSource> source);

// Takes finished rows in ascending order; one thread at a time. The destructor of a sink that was not
// finished leaves nothing behind.
class RowSink {
 public:
  virtual ~RowSink() = default;
  // `rows`: full width, interleaved, contiguous, of the type the sink was opened with.
  virtual void Write(const ConstImageView& rows) = 0;
  virtual int RowGranularity() const { return 1; }
};

}  // namespace tessera::graph
TESSERA_API_END

#endif  // TESSERA_GRAPH_SOURCE_H_
