// OpenCV's serial functions on several threads: each takes a band of rows, as a caller would do it.
#ifndef TESSERA_BENCH_PEERS_OPENCV_ROWS_H_
#define TESSERA_BENCH_PEERS_OPENCV_ROWS_H_

#include <algorithm>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "workers.h"

namespace tessera::bench {

class OpenCvRows {
 public:
  using Call = std::function<void(const std::vector<cv::Mat>& in, cv::Mat& out)>;

  // `margin` is the number of rows that a function reads beyond a band's edge and does not look for in the
  // picture that the band is part of; most of OpenCV's filters do look there, and need none.
  OpenCvRows(int threads, Call call, int margin = 0)
      : call_(std::move(call)), margin_(margin), workers_(std::make_shared<Workers>(threads)) {}

  void operator()(const std::vector<cv::Mat>& in, cv::Mat out) const {
    workers_->Run([&](int thread) {
      const int count = workers_->count();
      const cv::Range rows(out.rows * thread / count, out.rows * (thread + 1) / count);
      if (rows.empty()) return;
      const cv::Range read(std::max(0, rows.start - margin_), std::min(out.rows, rows.end + margin_));
      std::vector<cv::Mat> bands;
      for (const cv::Mat& image : in) bands.push_back(count == 1 ? image : image.rowRange(read));
      if (count == 1) return call_(bands, out);
      cv::Mat band = out.rowRange(rows);
      if (margin_ == 0) return call_(bands, band);
      cv::Mat whole;
      call_(bands, whole);
      whole.rowRange(rows.start - read.start, rows.end - read.start).copyTo(band);
    });
  }

 private:
  Call call_;
  int margin_;
  std::shared_ptr<Workers> workers_;
};

}  // namespace tessera::bench

#endif  // TESSERA_BENCH_PEERS_OPENCV_ROWS_H_
