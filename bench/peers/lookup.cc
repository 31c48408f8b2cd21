// OpenColorIO, OpenCV and Little CMS as peers of the lookups.
#include <OpenColorIO/OpenColorIO.h>

#include <cmath>
#include <memory>

#include "lookup_peers.h"
#include "tessera/error.h"

#if defined(TESSERA_BENCH_OPENCV_IMGPROC)
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#endif
#if defined(TESSERA_BENCH_LCMS)
#include <lcms2.h>
#endif

namespace tessera::bench {
namespace {

namespace ocio = OCIO_NAMESPACE;

PeerCall Apply(const ocio::TransformRcPtr& transform, const Image& input, const Image& output) {
  const PixelType type = input.spec().type;
  const ocio::BitDepth depth = type == PixelType::kUint8 ? ocio::BIT_DEPTH_UINT8 : ocio::BIT_DEPTH_F32;
  const ocio::ConstCPUProcessorRcPtr cpu =
      ocio::Config::CreateRaw()->getProcessor(transform)->getOptimizedCPUProcessor(
          depth, depth, ocio::OPTIMIZATION_DEFAULT);
  return [cpu, depth, from = input.view(), to = output.view()] {
    const auto describe = [depth](const ImageView& v) {
      return ocio::PackedImageDesc(v.data, v.roi.width(), v.roi.height(), v.channels, depth, v.channel_stride,
                                   v.pixel_stride, v.row_stride);
    };
    const ocio::PackedImageDesc source = describe(from);
    ocio::PackedImageDesc sink = describe(to);
    cpu->apply(source, sink);
  };
}

[[maybe_unused]] PeerCall Missing(const char* name) {
  return [name] { throw Error(name, "is not built in, expected its development package"); };
}

}  // namespace

PeerCall OcioCube(const Table& table, bool tetrahedral, const Image& input, const Image& output) {
  const int n = table.size(0);
  const ocio::Lut3DTransformRcPtr lut = ocio::Lut3DTransform::Create(static_cast<unsigned long>(n));
  for (int b = 0; b < n; ++b) {
    for (int g = 0; g < n; ++g) {
      for (int r = 0; r < n; ++r) {
        const int64_t i = (int64_t{b} * n + g) * n + r;
        lut->setValue(static_cast<unsigned long>(r), static_cast<unsigned long>(g),
                      static_cast<unsigned long>(b), table.At(i, 0), table.At(i, 1), table.At(i, 2));
      }
    }
  }
  lut->setInterpolation(tetrahedral ? ocio::INTERP_TETRAHEDRAL : ocio::INTERP_LINEAR);
  return Apply(lut, input, output);
}

PeerCall OcioCurve(const Table& table, const Image& input, const Image& output) {
  const auto n = static_cast<unsigned long>(table.size(0));
  const ocio::Lut1DTransformRcPtr lut = ocio::Lut1DTransform::Create(n, false);
  for (unsigned long i = 0; i < n; ++i) {
    const float v = table.At(static_cast<int64_t>(i), 0);
    lut->setValue(i, v, v, v);
  }
  lut->setInterpolation(ocio::INTERP_LINEAR);
  return Apply(lut, input, output);
}

#if defined(TESSERA_BENCH_OPENCV_IMGPROC)
PeerCall OpenCvCodes(const std::vector<Table>& tables, bool one, const Image& input, const Image& output) {
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
  return [lut, from = input.view(), to = output.view()] {
    cv::setNumThreads(1);
    const cv::Mat source(from.roi.height(), from.roi.width(), CV_8UC4, from.data);
    cv::Mat sink(to.roi.height(), to.roi.width(), CV_8UC4, to.data);
    cv::LUT(source, *lut, sink);
  };
}

PeerCall OpenCvRemap(const Image& texture, bool cubic, const Image& coords, const Image& output) {
  const Roi& r = coords.spec().data_window;
  const auto x = std::make_shared<cv::Mat>(r.height(), r.width(), CV_32F),
             y = std::make_shared<cv::Mat>(x->size(), CV_32F);
  for (int j = 0; j < r.height(); ++j) {
    for (int i = 0; i < r.width(); ++i) {
      x->at<float>(j, i) = coords.at<float>(i, j, 0) * static_cast<float>(texture.spec().width()) - 0.5f;
      y->at<float>(j, i) = coords.at<float>(i, j, 1) * static_cast<float>(texture.spec().height()) - 0.5f;
    }
  }
  return [x, y, cubic, texture, to = output.view()] {
    cv::setNumThreads(1);
    const int type = CV_32FC(to.channels);
    const cv::Mat source(texture.spec().height(), texture.spec().width(), type, texture.view().data);
    cv::Mat sink(to.roi.height(), to.roi.width(), type, to.data);
    cv::remap(source, sink, *x, *y, cubic ? cv::INTER_CUBIC : cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  };
}
#else
PeerCall OpenCvCodes(const std::vector<Table>&, bool, const Image&, const Image&) {
  return Missing("OpenCV");
}
PeerCall OpenCvRemap(const Image&, bool, const Image&, const Image&) { return Missing("OpenCV"); }
#endif

#if defined(TESSERA_BENCH_LCMS)
PeerCall LcmsInks(const Table& table, const Image& input, const Image& output) {
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
  return [owned, inks, to = output.view()] {
    cmsDoTransform(owned.get(), inks->data(), to.data, static_cast<cmsUInt32Number>(to.roi.pixels()));
  };
}
#else
PeerCall LcmsInks(const Table&, const Image&, const Image&) { return Missing("Little CMS"); }
#endif

}  // namespace tessera::bench
