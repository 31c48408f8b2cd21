// Blocks of a row: loads, stages on planes or on the pixels themselves, stores.
#include "graph/run_points.h"

#include <algorithm>
#include <cstring>

namespace tessera::graph {
namespace {

// The length of the next block: whole blocks, then whole groups, then a tail shorter than a group.
int BlockLength(int left, int block) {
  if (left >= block) return block;
  return left >= kGroupPixels ? left / kGroupPixels * kGroupPixels : left;
}

}  // namespace

PointsRunner::PointsRunner(const Program& program, const Points& points, BufferId to, Context& context)
    : pixels_(simd::CurrentPixelFunctions()), whole_rows_(points.whole_rows) {
  planes_ = base::AllocateAligned(context, Z(points.planes) * kBlockPixels * sizeof(float));
  float* const memory = reinterpret_cast<float*>(planes_.get());
  const auto plane = [memory](PlaneId p) { return memory + ptrdiff_t{p} * kBlockPixels; };
  std::fill_n(memory, Z(points.planes) * kBlockPixels, 0.0f);
  std::fill_n(plane(kOnePlane), kBlockPixels, 1.0f);
  for (const ConstantPlane& c : points.constants) std::fill_n(plane(c.plane), kBlockPixels, c.value);

  for (const BlockOp& op : points.ops) {
    if (const auto* const planned = std::get_if<LoadOp>(&op)) {
      Load& load = std::get<Load>(items_.emplace_back(Load()));
      const Layout& layout = program.layout(planned->from);
      load.from = planned->from;
      load.args.type = layout.type;
      load.args.pixel_stride = layout.pixel_stride;
      for (size_t p = 0; p < 4; ++p) {
        if (planned->channel[p] < 0) continue;
        load.args.channel[p] = planned->channel[p] * layout.channel_stride;
        load.args.plane[p] = plane(planned->plane[p]);
      }
      continue;
    }
    const auto& planned = std::get<ComputeOp>(op);
    Compute& compute = std::get<Compute>(items_.emplace_back(Compute()));
    compute.stage = planned.stage;
    compute.direct = planned.direct;
    compute.to_result = planned.to_result;
    compute.inputs = std::make_unique<const float*[][4]>(planned.in.size());
    for (size_t k = 0; k < planned.in.size(); ++k) {
      for (size_t p = 0; p < 4; ++p) compute.inputs[k][p] = plane(planned.in[k][p]);
    }
    PointArgs& args = compute.args;
    args.order = pixels_.order;
    if (!points.whole_rows) {  // else a row may be longer than a plane: there is none to be touched
      args.in = compute.inputs.get();
      for (size_t p = 0; p < 4; ++p) args.out[p] = plane(planned.out[p]);
    }
    args.codes = planned.codes;
    const auto type_of = [&](size_t k) {
      return planned.direct[k] < 0 ? PixelType::kFloat : program.layout(planned.direct[k]).type;
    };
    args.source.type = type_of(0);
    args.others[0].type = type_of(1);
    args.others[1].type = type_of(2);
    args.sink.type = program.layout(to).type;
  }

  const Layout& result = program.layout(to);
  for (size_t c = 0; c < points.result.size(); c += 4) {
    simd::StoreArgs& store = stores_.emplace_back();
    store.type = result.type;
    store.pixel_stride = result.pixel_stride;
    for (size_t p = 0; p < 4 && c + p < points.result.size(); ++p) {
      store.channel[p] = static_cast<ptrdiff_t>(c + p) * result.channel_stride;
      store.plane[p] = plane(points.result[c + p]);
    }
  }
}

void PointsRunner::Run(std::span<const ConstImageView> views, const ImageView& out, bool stream) {
  for (auto& item : items_) {
    if (auto* const compute = std::get_if<Compute>(&item))
      compute->args.sink.stream = stream && compute->to_result;
  }
  for (simd::StoreArgs& store : stores_) store.stream = stream;
  const int block =
      whole_rows_ ? std::max(kBlockPixels, out.roi.width() / kGroupPixels * kGroupPixels) : kBlockPixels;
  for (int y = out.roi.y0; y < out.roi.y1; ++y) {
    for (int x = out.roi.x0; x < out.roi.x1;) {
      const int count = BlockLength(out.roi.x1 - x, block);
      RunBlock(views, out, x, y, count);
      x += count;
    }
  }
}

void PointsRunner::RunBlock(std::span<const ConstImageView> views, const ImageView& out, int x, int y,
                            int count) {
  const bool is_tail = count < kGroupPixels;
  for (auto& item : items_) {
    if (auto* const load = std::get_if<Load>(&item)) {
      load->args.pixels = views[Z(load->from)].At(x, y);
      load->args.count = count;
      pixels_.load(load->args);
      continue;
    }
    auto& compute = *std::get_if<Compute>(&item);
    PointArgs& args = compute.args;
    args.x = x;
    args.y = y;
    args.count = is_tail ? kGroupPixels : count;
    for (size_t k = 0; k < ComputeOp::kMostDirect; ++k) {
      if (compute.direct[k] < 0) continue;
      const ConstImageView& view = views[Z(compute.direct[k])];
      const std::byte* const pixels = view.At(x, y);
      DirectPixels& direct = k == 0 ? args.source : args.others[k - 1];
      direct.read = is_tail ? tail_in_[k].pixels : pixels;
      if (is_tail) std::memcpy(tail_in_[k].pixels, pixels, Z(count) * 4 * PixelBytes(direct.type));
    }
    std::byte* const to = out.At(x, y);
    if (compute.to_result) args.sink.write = is_tail ? tail_out_.pixels : to;
    compute.stage->Run(args);
    if (compute.to_result && is_tail) {
      std::memcpy(to, tail_out_.pixels, Z(count) * 4 * PixelBytes(args.sink.type));
    }
  }
  for (simd::StoreArgs& store : stores_) {
    store.pixels = out.At(x, y);
    store.count = count;
    pixels_.store(store);
  }
}

}  // namespace tessera::graph
