// Chunks on every core.
#include "io/codec/chunked.h"

#include <algorithm>
#include <atomic>
#include <utility>

#include "sched/scheduler.h"

namespace tessera::io {
namespace {

constexpr int kRowsOfATask = 16;

}  // namespace

void ChunkedDecoder::Limit(int threads, size_t memory) {
  threads_ = threads;
  memory_ = memory;
}

int ChunkedDecoder::Height(int chunk) const { return std::min(spec_.y + spec_.height - Top(chunk), rows_); }

bool ChunkedDecoder::Read(const ImageView& out) {
  // A packed one, one in the packer's order, an unpacked one, for each worker, and what is kept.
  const bool small = Bytes(0) <= size_t{1} << 20;
  if (!small && Bytes(0) > memory_ / (3 * static_cast<size_t>(threads_) + 2)) return RefuseMemory();
  if (!prepared_) Prepare(threads_);
  prepared_ = true;
  const int first = (out.roi.y0 - spec_.y) / rows_, last = (out.roi.y1 - 1 - spec_.y) / rows_;
  const int group = std::max(1, kRowsOfATask / rows_);
  std::atomic<bool> failed = false;
  sched::InnerFor((int64_t{last} - first + group) / group, threads_, [&](int64_t task, int worker) {
    const int begin = first + static_cast<int>(task) * group;
    for (int chunk = begin; chunk <= std::min(last, begin + group - 1) && !failed; ++chunk) {
      if (!ReadChunk(chunk, chunk == last, worker, out)) failed = true;
    }
  });
  if (next_chunk_ >= 0) {
    kept_.swap(next_);
    kept_chunk_ = std::exchange(next_chunk_, -1);
  }
  return !failed;
}

// The rows of `out` that are in the chunk. The last of them may be a part; the rest of it is asked for next.
bool ChunkedDecoder::ReadChunk(int chunk, bool last, int worker, const ImageView& out) {
  const int top = Top(chunk), bottom = top + Height(chunk);
  const uint8_t* rows = chunk == kept_chunk_ ? kept_.data() : Unpack(chunk, worker);
  if (rows == nullptr) return false;
  for (int y = std::max(top, out.roi.y0); y < std::min(bottom, out.roi.y1); ++y)
    PutRow(rows + row_ * static_cast<size_t>(y - top), out.At(out.roi.x0, y), out.pixel_stride);
  if (last && bottom > out.roi.y1 && chunk != kept_chunk_) {
    next_.assign(rows, rows + Bytes(chunk));
    next_chunk_ = chunk;
  }
  return true;
}

}  // namespace tessera::io
