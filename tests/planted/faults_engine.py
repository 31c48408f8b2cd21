"""Faults of the engine: in each rewrite rule, loads, stores, moves of bytes, regions, bands, borders, files."""
from faults import Fault

REWRITES = "src/graph/rewrites.cc"
PIXELS = "src/simd/pixels.cc"

FAULTS = [
    # Rewrite rules.
    Fault("typed-window-type", "rule typed-window", REWRITES,
          "!program.IsSource(from) || !program.layout(from).IsDense(result.type) ||",
          "!program.IsSource(from) || !program.layout(from).IsDense(program.layout(from).type) ||",
          "a source's codes are taken for those of the result's type"),
    Fault("source-as-tile-strides", "rule source-as-tile", REWRITES,
          "!program.layout(from).IsDense(PixelType::kFloat) || !program.layout(from).ascending) {",
          "program.layout(from).type != PixelType::kFloat || !program.layout(from).ascending) {",
          "floats with gaps between them, or plane by plane, are taken for a tile"),
    Fault("tile-in-result-strides", "rule tile-in-result", REWRITES,
          "!program.layout(program.result()).IsDense(PixelType::kFloat)) {",
          "program.layout(program.result()).type != PixelType::kFloat) {",
          "a tile is made where the caller's floats have gaps"),
    Fault("move-bytes-same", "rule move-bytes", "src/graph/rewrite_moves.cc",
          "origin->channel == static_cast<int>(c) &&\n                   layout.channels == result.channels;",
          "origin->channel == static_cast<int>(c);",
          "the first channels of wider pixels are copied as if they were all"),
    Fault("samples-order", "rule samples", REWRITES,
          "program.layout(load->from)) ||\n"
          "          !std::equal(in.begin(), in.begin() + static_cast<ptrdiff_t>(count), load->plane.begin()) ||\n"
          "          !std::equal(kRgba.begin(), kRgba.begin() + static_cast<ptrdiff_t>(count), "
          "load->channel.begin())) {",
          "program.layout(load->from))) {",
          "rows of samples although the channels come in another order"),
    Fault("all-in-type", "rule all-in-operation", REWRITES,
          "if (load == points->ops.size() ||\n"
          "          program.layout(std::get<LoadOp>(points->ops[load]).from).type != type) {",
          "if (load == points->ops.size()) {",
          "an input of another type than the result is read as if it were of the same"),
    Fault("load-in-read-twice", "rule load-in-operation", REWRITES,
          "RgbaLoadOf(program, *points, *op, 0, PlaneReaders(*points));",
          "RgbaLoadOf(program, *points, *op, 0, std::vector<int>(static_cast<size_t>(points->planes), 1));",
          "a load is taken into an operation although another reads its planes"),
    Fault("store-in-order", "rule store-in-operation", REWRITES,
          "AreReadOnce(op.out, readers) &&\n         std::equal(op.out.begin(), op.out.end(), points.result.begin());",
          "AreReadOnce(op.out, readers);",
          "an operation stores its pixels although their channels are to change places"),
    Fault("codes-bias", "rule codes", "src/ops/color/affine_kernel.cc",
          "codes(255), codes(65535));",
          "codes(255), codes(65536));",
          "on 16-bit codes sums are one part in 65536 too large"),
    Fault("source-as-whole-strides", "rule source-as-whole", "src/graph/render.cc",
          "if (view && IsDenseFloat(*view)) {",
          "if (view && view->type == PixelType::kFloat) {",
          "a source with gaps between its floats is taken for a whole image"),

    # Loads and stores.
    Fault("load-16-tail", "load 16 bits", PIXELS,
          "sizeof(T) * (count - whole) * samples_per_pixel);\n  body(rest, whole, kGroupPixels);",
          "sizeof(T) * (count - whole - (sizeof(T) == 2 ? 1 : 0)) * samples_per_pixel);\n"
          "  body(rest, whole, kGroupPixels);",
          "the last pixel of a row of halves or 16-bit codes is 0 where a group of 16 is not full"),
    Fault("load-rgb-bytes", "load RGB 8 bits", PIXELS,
          "x = ToPlaneOrder(value(a)), y = ToPlaneOrder(value(b)), z = ToPlaneOrder(value(c));",
          "x = ToPlaneOrder(value(a)), y = ToPlaneOrder(value(b)), z = ToPlaneOrder(value(c));\n"
          "  if constexpr (type == PixelType::kUint8) y = hn::Mul(y, hn::Set(D(), 1.0001f));",
          "green of three bytes is 1e-4 too large"),
    Fault("store-rgb-16", "store RGB 16 bits", PIXELS,
          "hn::StoreInterleaved3(sample(x), sample(y), sample(z), d, p);",
          "if constexpr (type == PixelType::kUint16)\n"
          "    hn::StoreInterleaved3(sample(x), sample(z), sample(y), d, p);\n"
          "  else\n"
          "    hn::StoreInterleaved3(sample(x), sample(y), sample(z), d, p);",
          "green and blue change places in pixels of three 16-bit codes"),
    Fault("load-part", "load part of pixels", PIXELS,
          "LoadTyped<type>(compact.Of(args, layout));",
          "LoadArgs here = compact.Of(args, layout);\n"
          "    if (layout.present == 3) here.count = std::max(1, here.count - here.count % 16);\n"
          "    LoadTyped<type>(here);",
          "of three channels of wider pixels the end of a row is left as it was"),
    Fault("store-part-half", "store part of pixels", PIXELS,
          "[](std::byte* pixel, const T* from, size_t bytes)\n"
          "                          HWY_ATTR { std::memcpy(pixel, from, bytes); });",
          "[](std::byte* pixel, const T* from, size_t bytes) HWY_ATTR {\n"
          "                        std::memcpy(pixel, from, type == PixelType::kHalf ? bytes - 1 : bytes);\n"
          "                      });",
          "the last byte of halves beside other channels is not written"),
    Fault("store-planar-bytes", "store planes", PIXELS,
          "S::StoreValues(ToPixelOrder(hn::LoadU(D(), plane + first + i)), p + i, around);",
          "const V v = hn::LoadU(D(), plane + first + i);\n"
          "      S::StoreValues(type == PixelType::kUint8 && i + kLanes == kBlockPixels ? v : ToPixelOrder(v), p + i,\n"
          "                     around);",
          "the last vector of a full block of one byte's planes is stored in another order"),
    Fault("store-rgba-half", "store RGBA halves", PIXELS,
          "StoreRgba<type, true>(LoadPlanes(plane, first + i), p + 4 * i, around);",
          "{\n        Pixels q = LoadPlanes(plane, first + i);\n"
          "        if constexpr (type == PixelType::kHalf) q.b = hn::MulAdd(q.b, hn::Set(D(), 0x1p-11f), q.b);\n"
          "        StoreRgba<type, true>(q, p + 4 * i, around);\n      }",
          "blue is half a unit of its last place too large before it is rounded to halves"),
    Fault("store-around", "store around cache", PIXELS,
          "body(pixels, 0, whole, stream && CanStream(pixels));",
          "body(pixels, 0, stream && CanStream(pixels) && whole > kGroupPixels ? whole - kGroupPixels : whole,\n"
          "       stream && CanStream(pixels));",
          "around the cache the last group of a block is not written"),
    Fault("moves-constant", "moves of bytes", "src/simd/moves.cc",
          "constants[at] = static_cast<uint8_t>(byte.constant);",
          "constants[at] = s > 0 && s + 1 == step ? uint8_t{0} : static_cast<uint8_t>(byte.constant);",
          "a constant channel is 0 in the last pixel of those that are moved together"),

    # Steps, regions, bands, borders.
    Fault("samples-tail", "rows of samples", "src/graph/run.cc",
          "std::memcpy(to + done, tail_out.pixels, row - done);",
          "std::memcpy(to + done, tail_out.pixels, inputs > 1 ? row - done - 1 : row - done);",
          "the last byte of a row of samples of two images is not written"),
    Fault("planes-constant", "planes", "src/graph/program.cc",
          "last[Z(constant.plane)] = kForever;",
          "if (last[Z(constant.plane)] < 0) last[Z(constant.plane)] = kForever;",
          "the plane of a constant that an operation reads is used again after it"),
    Fault("pixels-tail", "operations on pixels", "src/graph/run_points.cc",
          "std::memcpy(tail_in_[k].pixels, pixels, Z(count) * 4 * PixelBytes(direct.type));",
          "std::memcpy(tail_in_[k].pixels, pixels,\n"
          "                               Z(k == 1 && count > 1 ? count - 1 : count) * 4 * PixelBytes(direct.type));",
          "the last pixel of the second image's rows is an older one"),
    Fault("region-of-two", "regions", "src/graph/plan.cc",
          "            Union(wanted, BorderSource(stage.InputRoi(n, r.buffers[i]), in.window, stage.InputBorder(n)));",
          "            BorderSource(stage.InputRoi(n, r.buffers[i]), in.window, stage.InputBorder(n));",
          "of two operations that read a tile only one gets the region that it needs"),
    Fault("tile-columns", "tiles", "src/graph/executor.cc",
          "const int64_t columns = (int64_t{out.roi.width()} + shape.width - 1) / shape.width;",
          "const int64_t columns = (int64_t{out.roi.width()} + shape.width - 2) / shape.width;",
          "a last tile of one column is never made"),
    Fault("border-mirror", "borders", "src/graph/border.cc",
          "return static_cast<int>(lo + (k < n ? k : period - k));",
          "return static_cast<int>(lo + (k < n ? k : period - 1 - k));",
          "mirror101 is one pixel off beyond the far edge"),

    # Files.
]
