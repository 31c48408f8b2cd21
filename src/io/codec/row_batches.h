// Rows as they come, handed on in batches of a given height.
#ifndef TESSERA_IO_CODEC_ROW_BATCHES_H_
#define TESSERA_IO_CODEC_ROW_BATCHES_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/bytes.h"

namespace tessera::io {

class RowBatches {
 public:
  // `height`: rows in all, after which the rest is handed on whatever its height.
  RowBatches(size_t row_bytes, size_t batch, size_t height) : row_(row_bytes), batch_(batch), left_(height) {}

  // Calls put(span of pointers to rows) for what is whole: one batch or several. What is not is copied.
  template <typename Put>
  void Add(size_t rows, const std::byte* data, ptrdiff_t row_stride, const Put& put) {
    const auto* from = reinterpret_cast<const uint8_t*>(data);
    std::vector<const uint8_t*> pending;
    while (rows > 0) {
      const size_t kept = kept_.size() / row_;
      const bool ends = rows == left_, keep = kept > 0 || (rows < batch_ && !ends);
      const size_t count = keep ? std::min(rows, batch_ - kept) : ends ? rows : rows / batch_ * batch_;
      pending.clear();
      for (size_t i = 0; i < count; ++i, from += row_stride) {
        if (keep) {
          kept_.insert(kept_.end(), from, from + row_);
        } else {
          pending.push_back(from);
        }
      }
      rows -= count;
      left_ -= count;
      if (keep && (kept + count == batch_ || left_ == 0)) {
        for (size_t at = 0; at < kept_.size(); at += row_) pending.push_back(kept_.data() + at);
      }
      if (pending.empty()) continue;
      put(std::span<const uint8_t* const>(pending));
      kept_.clear();
    }
  }

 private:
  const size_t row_, batch_;
  size_t left_;
  base::Bytes kept_;
};

}  // namespace tessera::io

#endif  // TESSERA_IO_CODEC_ROW_BATCHES_H_
