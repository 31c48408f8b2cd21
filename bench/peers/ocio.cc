// OpenColorIO's optimised CPU processor as a peer: the whole task as one group transform, applied to packed
// images, rows split over threads by the caller, as its applications do. Compiled once for every version of
// it, TESSERA_BENCH_OCIO names the namespace.
#include <OpenColorIO/OpenColorIO.h>

#include <cstddef>
#include <functional>
#include <memory>

#include "contestant.h"
#include "peers/ocio_peer.h"
#include "peers/peers.h"
#include "tessera/table.h"
#include "workers.h"

namespace tessera::bench::TESSERA_BENCH_OCIO {
namespace {

namespace ocio = OCIO_NAMESPACE;

// A curve by name, or null when OpenColorIO has none that equals it.
ocio::TransformRcPtr CurveOf(const ops::Arguments& a) {
  const std::string& name = a.Text("NAME");
  ocio::TransformRcPtr result;
  if (name == "srgb") {
    ocio::ExponentWithLinearTransformRcPtr transform = ocio::ExponentWithLinearTransform::Create();
    transform->setGamma({2.4, 2.4, 2.4, 1});
    transform->setOffset({0.055, 0.055, 0.055, 0});
    transform->setDirection(ocio::TRANSFORM_DIR_INVERSE);
    result = transform;
  } else if (name == "gamma") {
    ocio::ExponentTransformRcPtr transform = ocio::ExponentTransform::Create();
    const double exponent = 1 / a.Number("exponent");
    transform->setValue({exponent, exponent, exponent, 1});
    result = transform;
  } else if (name == "log2" || name == "log10" || name == "ln") {
    ocio::LogTransformRcPtr transform = ocio::LogTransform::Create();
    transform->setBase(name == "log2" ? 2 : name == "ln" ? 2.718281828459045 : 10);
    result = transform;
  } else if (name == "acescct" || name == "pq") {
    ocio::BuiltinTransformRcPtr transform = ocio::BuiltinTransform::Create();
    transform->setStyle(name == "pq" ? "CURVE - LINEAR_to_ST-2084" : "CURVE - ACEScct-LOG_to_LINEAR");
    if (name == "acescct") transform->setDirection(ocio::TRANSFORM_DIR_INVERSE);
    result = transform;
    if (name == "pq") {
      // OpenColorIO's light is in units of 100 cd/m^2.
      const double units[] = {100, 0, 0, 0, 0, 100, 0, 0, 0, 0, 100, 0, 0, 0, 0, 1};
      ocio::MatrixTransformRcPtr matrix = ocio::MatrixTransform::Create();
      matrix->setMatrix(units);
      ocio::GroupTransformRcPtr group = ocio::GroupTransform::Create();
      group->appendTransform(matrix);
      group->appendTransform(result);
      result = group;
    }
  } else {
    return nullptr;
  }
  if (a.Flag("inverse")) {
    result->setDirection(result->getDirection() == ocio::TRANSFORM_DIR_INVERSE ? ocio::TRANSFORM_DIR_FORWARD
                                                                               : ocio::TRANSFORM_DIR_INVERSE);
  }
  return result;
}

// The transforms of one step, or null when OpenColorIO has none that equals it.
ocio::TransformRcPtr TransformOf(const Step& step) {
  if (step.affine) {
    double matrix[16], offset[4];
    for (int r = 0; r < 4; ++r) {
      for (int c = 0; c < 4; ++c) matrix[r * 4 + c] = step.affine->m[r][c];
      offset[r] = step.affine->m[r][4];
    }
    ocio::MatrixTransformRcPtr transform = ocio::MatrixTransform::Create();
    transform->setMatrix(matrix);
    transform->setOffset(offset);
    return transform;
  }
  if (step.op() == "clamp") {
    const auto range = ClampRange(step);
    if (!range) return nullptr;
    const auto& [lo, hi] = *range;
    for (int c = 1; c < 3; ++c) {
      if (lo[c] != lo[0] || hi[c] != hi[0]) return nullptr;
    }
    // Alpha is left alone; the tasks keep it inside the limits.
    ocio::RangeTransformRcPtr transform = ocio::RangeTransform::Create();
    transform->setStyle(ocio::RANGE_CLAMP);
    if (lo[0] > -1e30) transform->setMinInValue(lo[0]), transform->setMinOutValue(lo[0]);
    if (hi[0] < 1e30) transform->setMaxInValue(hi[0]), transform->setMaxOutValue(hi[0]);
    return transform;
  }
  if (step.op() == "powc") {
    const std::vector<double> exponent = step.Positional(0);
    double values[4];
    for (size_t c = 0; c < 4; ++c) values[c] = exponent.size() == 1 ? exponent[0] : exponent.at(c);
    ocio::ExponentTransformRcPtr transform = ocio::ExponentTransform::Create();
    transform->setNegativeStyle(ocio::NEGATIVE_CLAMP);
    transform->setValue(values);
    return transform;
  }
  if (step.op() == "lut") {
    ocio::FileTransformRcPtr transform = ocio::FileTransform::Create();
    transform->setSrc(step.arguments.Text("FILE").c_str());
    transform->setInterpolation(step.arguments.Text("interp") == "linear" ? ocio::INTERP_LINEAR
                                                                          : ocio::INTERP_BEST);
    return transform;
  }
  if (step.op() == "curve") return CurveOf(step.arguments);
  return nullptr;
}

// A transform on packed pixels from one picture to another of the same type.
class Rows {
 public:
  Rows(const ocio::TransformRcPtr& transform, const ImageView& from, const ImageView& to, int threads)
      : from_(from), to_(to), workers_(threads) {
    depth_ = from_.type == PixelType::kUint8    ? ocio::BIT_DEPTH_UINT8
             : from_.type == PixelType::kUint16 ? ocio::BIT_DEPTH_UINT16
             : from_.type == PixelType::kHalf   ? ocio::BIT_DEPTH_F16
                                                : ocio::BIT_DEPTH_F32;
    const ocio::ConstProcessorRcPtr processor = ocio::Config::CreateRaw()->getProcessor(transform);
    processor_ = processor->getOptimizedCPUProcessor(depth_, depth_, ocio::OPTIMIZATION_DEFAULT);
  }
  void Run() {
    workers_.Run([this](int i) {
      const int height = from_.roi.height();
      const int y0 = height * i / workers_.count(), y1 = height * (i + 1) / workers_.count();
      const ocio::PackedImageDesc from = Describe(from_, y0, y1);
      ocio::PackedImageDesc to = Describe(to_, y0, y1);
      processor_->apply(from, to);
    });
  }

 private:
  ocio::PackedImageDesc Describe(const ImageView& view, int y0, int y1) const {
    return {view.data + y0 * view.row_stride,
            view.roi.width(),
            y1 - y0,
            view.channels,
            depth_,
            view.channel_stride,
            view.pixel_stride,
            view.row_stride};
  }

  ImageView from_, to_;
  ocio::BitDepth depth_;
  ocio::ConstCPUProcessorRcPtr processor_;
  Workers workers_;
};

class Ocio final : public Contestant {
 public:
  Ocio(const std::string& name, const Setting& setting, const ocio::TransformRcPtr& transform)
      : name_(name),
        rows_(transform, setting.frame.inputs[0].view(), setting.frame.output.view(), setting.threads) {}
  std::string Name() const override { return name_; }
  void Run() override { rows_.Run(); }

 private:
  std::string name_;
  Rows rows_;
};

PeerCall Apply(const ocio::TransformRcPtr& transform, const Image& input, const Image& output, int threads) {
  const auto rows = std::make_shared<Rows>(transform, input.view(), output.view(), threads);
  return [rows, input, output] { rows->Run(); };
}

}  // namespace

std::string Version() { return ocio::GetVersion(); }

std::unique_ptr<Contestant> MakeChain(const Setting& setting, const std::string& name) {
  if (!setting.frame.plain() || setting.frame.inputs.size() != 1) return nullptr;
  ocio::GroupTransformRcPtr group = ocio::GroupTransform::Create();
  for (const Step& step : setting.task.steps) {
    const ocio::TransformRcPtr transform = TransformOf(step);
    if (!transform) return nullptr;
    group->appendTransform(transform);
  }
  return std::make_unique<Ocio>(name, setting, group);
}

PeerCall Cube(const Table& table, bool tetrahedral, const Image& input, const Image& output, int threads) {
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
  return Apply(lut, input, output, threads);
}

PeerCall Curve(const Table& table, const Image& input, const Image& output, int threads) {
  const auto n = static_cast<unsigned long>(table.size(0));
  const ocio::Lut1DTransformRcPtr lut = ocio::Lut1DTransform::Create(n, false);
  for (unsigned long i = 0; i < n; ++i) {
    const float v = table.At(static_cast<int64_t>(i), 0);
    lut->setValue(i, v, v, v);
  }
  lut->setInterpolation(ocio::INTERP_LINEAR);
  return Apply(lut, input, output, threads);
}

}  // namespace tessera::bench::TESSERA_BENCH_OCIO
