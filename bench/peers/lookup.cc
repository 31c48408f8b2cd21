// OpenCV and Little CMS as peers of the lookups.
#include <cmath>
#include <memory>

#include "lookup_peers.h"
#include "tessera/error.h"
#include "workers.h"

#if defined(TESSERA_BENCH_OPENCV_IMGPROC)
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#endif
#if defined(TESSERA_BENCH_LCMS)
#include <lcms2.h>
#endif

namespace tessera::bench {
namespace {

[[maybe_unused]] PeerCall Missing(const char* name) {
  return [name] { throw Error(name, "is not built in, expected its development package"); };
}

}  // namespace

#if defined(TESSERA_BENCH_OPENCV_IMGPROC)
PeerCall OpenCvCodes(const std::vector<Table>& tables, bool one, const Image& input, const Image& output,
                     int threads) {
  const auto lut = std::make_shared<cv::Mat>(1, 256, one ? CV_8UC1 : CV_8UC4);
  for (int code = 0; code < 256; ++code) {
    for (int c = 0; c < (one ? 1 : 4); ++c) {
      const double s = static_cast<float>(code / 255.0);
      double v = s;
      if (!tables[static_cast<size_t>(c)].empty()) SampleTable(tables[static_cast<size_t>(c)], {}, &s, &v);
      lut->data[code * (one ? 1 : 4) + c] =
          static_cast<uint8_t>(std::nearbyint(std::min(std::max(v, 0.0), 1.0) * 255));
    }
  }
  return [lut, threads, from = input.view(), to = output.view()] {
    cv::setNumThreads(threads);
    const cv::Mat source(from.roi.height(), from.roi.width(), CV_8UC4, from.data);
    cv::Mat sink(to.roi.height(), to.roi.width(), CV_8UC4, to.data);
    cv::LUT(source, *lut, sink);
  };
}

PeerCall OpenCvRemap(const Image& texture, bool cubic, const Image& coords, const Image& output,
                     int threads) {
  const Roi& r = coords.spec().data_window;
  const auto x = std::make_shared<cv::Mat>(r.height(), r.width(), CV_32F),
             y = std::make_shared<cv::Mat>(x->size(), CV_32F);
  for (int j = 0; j < r.height(); ++j) {
    for (int i = 0; i < r.width(); ++i) {
      x->at<float>(j, i) = coords.at<float>(i, j, 0) * static_cast<float>(texture.spec().width()) - 0.5f;
      y->at<float>(j, i) = coords.at<float>(i, j, 1) * static_cast<float>(texture.spec().height()) - 0.5f;
    }
  }
  return [x, y, cubic, threads, texture, to = output.view()] {
    cv::setNumThreads(threads);
    const int type = CV_32FC(to.channels);
    const cv::Mat source(texture.spec().height(), texture.spec().width(), type, texture.view().data);
    cv::Mat sink(to.roi.height(), to.roi.width(), type, to.data);
    cv::remap(source, sink, *x, *y, cubic ? cv::INTER_CUBIC : cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  };
}
#else
PeerCall OpenCvCodes(const std::vector<Table>&, bool, const Image&, const Image&, int) {
  return Missing("OpenCV");
}
PeerCall OpenCvRemap(const Image&, bool, const Image&, const Image&, int) { return Missing("OpenCV"); }
#endif

#if defined(TESSERA_BENCH_LCMS)
PeerCall LcmsInks(const Table& table, const Image& input, const Image& output, int threads) {
  // Little CMS lets the last channel vary fastest.
  const int n = table.size(0);
  std::vector<float> entries;
  for (int c = 0; c < n; ++c) {
    for (int m = 0; m < n; ++m) {
      for (int y = 0; y < n; ++y) {
        for (int k = 0; k < n; ++k) {
          const int64_t i = ((int64_t{k} * n + y) * n + m) * n + c;
          for (int channel = 0; channel < 3; ++channel) entries.push_back(table.At(i, channel));
        }
      }
    }
  }
  cmsPipeline* const pipeline = cmsPipelineAlloc(nullptr, 4, 3);
  cmsPipelineInsertStage(
      pipeline, cmsAT_END,
      cmsStageAllocCLutFloat(nullptr, static_cast<cmsUInt32Number>(n), 4, 3, entries.data()));
  cmsHPROFILE link = cmsCreateProfilePlaceholder(nullptr);
  cmsSetProfileVersion(link, 4.3);
  cmsSetDeviceClass(link, cmsSigLinkClass);
  cmsSetColorSpace(link, cmsSigCmykData);
  cmsSetPCS(link, cmsSigRgbData);
  cmsWriteTag(link, cmsSigDToB0Tag, pipeline);
  cmsWriteTag(link, cmsSigAToB0Tag, pipeline);
  cmsHTRANSFORM transform = cmsCreateMultiprofileTransform(&link, 1, TYPE_CMYK_FLT, TYPE_RGB_FLT,
                                                           INTENT_PERCEPTUAL, cmsFLAGS_NOCACHE);
  cmsCloseProfile(link);
  cmsPipelineFree(pipeline);
  if (transform == nullptr) throw Error("Little CMS", "refuses the device link");
  // Its ink values are percentages.
  const auto inks = std::make_shared<std::vector<float>>();
  const auto* const samples = reinterpret_cast<const float*>(input.view().data);
  const auto count = static_cast<size_t>(input.spec().data_window.pixels()) * 4;
  for (size_t i = 0; i < count; ++i) inks->push_back(100 * samples[i]);
  const std::shared_ptr<void> owned(transform, cmsDeleteTransform);
  const auto workers = std::make_shared<Workers>(threads);
  return [owned, inks, workers, to = output.view()] {
    workers->Run([&](int i) {
      const int64_t pixels = to.roi.pixels(), first = pixels * i / workers->count(),
                    end = pixels * (i + 1) / workers->count();
      cmsDoTransform(owned.get(), inks->data() + 4 * first, to.data + first * to.pixel_stride,
                     static_cast<cmsUInt32Number>(end - first));
    });
  };
}
#else
PeerCall LcmsInks(const Table&, const Image&, const Image&, int) { return Missing("Little CMS"); }
#endif

}  // namespace tessera::bench
