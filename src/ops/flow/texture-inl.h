// The texture's samples at the taps of lines: nearest or bilinear, inside, clamped, repeated or ended.
#if defined(TESSERA_OPS_FLOW_TEXTURE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_FLOW_TEXTURE_INL_H_
#undef TESSERA_OPS_FLOW_TEXTURE_INL_H_
#else
#define TESSERA_OPS_FLOW_TEXTURE_INL_H_
#endif

#include <hwy/highway.h>

#include "ops/flow/field-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::flow::HWY_NAMESPACE {

// The texture at indices relative to the packet's first pixel, in multiples of Lines::unit.
HWY_INLINE V TexelsAt(const Place& place, VI at, int channel) {
  const D d;
  if (place.codes == nullptr) return s::GatherFloats(place.texture + channel, at);
  const VU index = hn::Add(hn::BitCast(DU(), at), hn::Set(DU(), place.first_code));
  return hn::ConvertTo(d, hn::BitCast(DI(), hn::And(LoadBytes(place.codes, index), hn::Set(DU(), 255))));
}

// Where a tap's samples are, relative to the packet's first pixel. `inside` is 1 where the line may go on,
// else 0.
template <bool kLinear>
struct Texels {
  VI at;
  V inside;
  HWY_INLINE V Value(const Place& place, int channel) const { return TexelsAt(place, at, channel); }
};
template <>
struct Texels<true> {
  VI at00, at10, at01, at11;
  V tx, ty, inside;
  HWY_INLINE V Value(const Place& place, int channel) const {
    const D d;
    const V a = TexelsAt(place, at00, channel), b = TexelsAt(place, at10, channel);
    const V low_a = TexelsAt(place, at01, channel), low_b = TexelsAt(place, at11, channel);
    // Weight 0 takes nothing: NaN spreads only where it has weight.
    const auto lerp = [&](V p, V q, V t) HWY_ATTR {
      const V between = hn::MulAdd(t, hn::Sub(q, p), p);
      return hn::IfThenElse(hn::Eq(t, hn::Zero(d)), p, between);
    };
    return lerp(lerp(a, b, tx), lerp(low_a, low_b, tx), ty);
  }
};

// Indices into the picture, whatever the border.
template <bool kChecked>
HWY_INLINE void Limit(const Lines& lines, const Place& place, VI& x, VI& y) {
  if constexpr (kChecked) {
    const DI di;
    const auto limit = [&](VI at, int first, int size, bool around) HWY_ATTR {
      const VI start = hn::Set(di, first);
      if (around) return hn::Sub(Wrap(hn::Add(at, start), size), start);
      return hn::Min(hn::Max(at, hn::Set(di, -first)), hn::Set(di, size - 1 - first));
    };
    x = limit(x, place.x, lines.width, lines.around_x), y = limit(y, place.y, lines.height, lines.around_y);
  }
}

// 1 where a line at these pixels may go on: they exist (unless the border says otherwise) and are not masked.
HWY_INLINE V Inside(const Lines& lines, const Place& place, VI x, VI y) {
  const D d;
  const DI di;
  VI in_x = x, in_y = y;
  Limit<true>(lines, place, in_x, in_y);
  V inside = hn::Set(d, 1.0f);
  if (lines.wrap == Wrap::kRenormalize) {
    const auto there = [&](VI in, VI at, bool around) HWY_ATTR {
      return around ? hn::Set(di, 1) : hn::IfThenElseZero(hn::Eq(in, at), hn::Set(di, 1));
    };
    inside = hn::ConvertTo(d, hn::And(there(in_x, x, lines.around_x), there(in_y, y, lines.around_y)));
  }
  if (lines.mask != nullptr) {
    const VI at = hn::Add(hn::Mul(in_y, hn::Set(di, lines.width)), in_x);
    const VI masked = s::GatherWords<4>(place.mask, at);
    inside = hn::IfThenElseZero(hn::RebindMask(d, hn::Eq(masked, hn::Zero(di))), inside);
  }
  return inside;
}

// What to add to WholeBits of a position, and to those of y in rows plus those of x, for the pixel and its
// code.
struct CodeBase {
  VU x, y, at;
};
HWY_INLINE CodeBase CodeBaseOf(const Lines& lines, const Place& place, const Starts& starts) {
  const DU du;
  const VU x = WholeBaseOf(starts.x), y = WholeBaseOf(starts.y);
  const VU row = hn::Set(du, static_cast<uint32_t>(lines.texture_row));
  return {x, y, hn::Add(hn::Add(hn::Mul(y, row), x), hn::Set(du, place.first_code))};
}

// The codes at the pixels nearest to positions within the picture, Lines::texture_step 1.
HWY_INLINE VI NearestCodes(const Lines& lines, const Place& place, const CodeBase& base, const V2& p) {
  const DU du;
  const VU bits_x = WholeBits(p.x), bits_y = WholeBits(p.y);
#if HWY_TARGET <= HWY_AVX3
  const VU x = hn::Add(bits_x, base.x), y = hn::Add(bits_y, base.y);
  // The lines of a packet stay together: mostly its taps lie within eight by eight pixels, a vector of bytes.
  // Those around one of its middle lines are loaded, which costs half of a gather.
  const hn::Full128<uint64_t> pair;
  const hn::Half<DU> half;
  const hn::Full128<uint32_t> quarter;
  const uint64_t middle = hn::GetLane(
      hn::BitCast(pair, hn::UpperHalf(quarter, hn::LowerHalf(half, hn::InterleaveUpper(du, x, y)))));
  const int left = static_cast<int>(middle) - 4, top = static_cast<int>(middle >> 32) - 4;
  const VU in_x = hn::Sub(x, hn::Set(du, static_cast<uint32_t>(left)));
  const VU in_y = hn::Sub(y, hn::Set(du, static_cast<uint32_t>(top)));
  if (HWY_LIKELY(hn::AllTrue(du, hn::Lt(hn::Or(in_x, in_y), hn::Set(du, 8))))) {
    const hn::CappedTag<uint64_t, 1> one;
    const uint8_t* const from = place.codes + top * lines.texture_row + left;
    const auto row = [&](int i) HWY_ATTR {
      return hn::LoadU(one, reinterpret_cast<const uint64_t*>(from + i * lines.texture_row));
    };
    const auto rows = [&](int i) HWY_ATTR { return hn::Combine(pair, row(i + 1), row(i)); };
    const hn::Repartition<uint64_t, hn::Half<DU>> four;
    const hn::Repartition<uint64_t, DU> eight;
    const auto low = hn::Combine(four, rows(2), rows(0)), high = hn::Combine(four, rows(6), rows(4));
    const VU window = hn::BitCast(du, hn::Combine(eight, high, low));
    const VU bit = hn::Add(hn::ShiftLeft<6>(in_y), hn::ShiftLeft<3>(in_x));
    const VU four_codes = hn::TableLookupLanes(window, hn::IndicesFromVec(du, hn::ShiftRight<5>(bit)));
    const VU code = hn::Shr(four_codes, hn::And(bit, hn::Set(du, 24)));
    return hn::BitCast(DI(), hn::And(code, hn::Set(du, 255)));
  }
#endif
  const VU rows = hn::Mul(bits_y, hn::Set(du, static_cast<uint32_t>(lines.texture_row)));
  const VU four = LoadBytes(place.codes, hn::Add(hn::Add(rows, bits_x), base.at));
  return hn::BitCast(DI(), hn::And(four, hn::Set(du, 255)));
}

template <bool kChecked, bool kLinear>
HWY_INLINE Texels<kLinear> FindTexels(const Lines& lines, const Place& place, const Starts& start,
                                      const V2& p) {
  const D d;
  const DI di;
  const VI row = hn::Set(di, static_cast<int>(lines.texture_row));
  const auto index = [&](VI x, VI y) HWY_ATTR {
    if (lines.texture_step != 1) x = hn::Mul(x, hn::Set(di, lines.texture_step));
    return hn::Add(hn::Mul(y, row), x);
  };
  Texels<kLinear> t;
  VI x = hn::Add(hn::NearestInt(p.x), start.x), y = hn::Add(hn::NearestInt(p.y), start.y);
  if constexpr (kChecked) t.inside = Inside(lines, place, x, y);
  if constexpr (kLinear) {
    const V floor_x = hn::Floor(p.x), floor_y = hn::Floor(p.y);
    t.tx = hn::Sub(p.x, floor_x), t.ty = hn::Sub(p.y, floor_y);
    x = hn::Add(hn::ConvertTo(di, floor_x), start.x), y = hn::Add(hn::ConvertTo(di, floor_y), start.y);
    VI x1 = hn::Add(x, hn::Set(di, 1)), y1 = hn::Add(y, hn::Set(di, 1));
    Limit<kChecked>(lines, place, x, y);
    Limit<kChecked>(lines, place, x1, y1);
    t.at00 = index(x, y), t.at10 = index(x1, y), t.at01 = index(x, y1), t.at11 = index(x1, y1);
  } else {
    Limit<kChecked>(lines, place, x, y);
    t.at = index(x, y);
  }
  (void)d;
  return t;
}

}  // namespace tessera::ops::flow::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
