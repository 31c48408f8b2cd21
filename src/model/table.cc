// Table: validation, storage in any pixel type, exact reading back.
#include "tessera/table.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "base/bytes.h"
#include "base/half.h"
#include "base/paged_memory.h"
#include "tessera/context.h"
#include "tessera/error.h"

namespace tessera {
namespace {

constexpr int64_t kMostEntries = std::numeric_limits<int32_t>::max();

// The code of a value among 0..last: round half to even of the exact product, saturating, NaN to 0.
template <typename T>
T Code(float value, double last) {
  const double v = value > 0 ? std::min(static_cast<double>(value), 1.0) : 0.0;
  return static_cast<T>(std::nearbyint(v * last));
}

void Store(float value, PixelType type, std::byte* to) {
  const auto put = [to](auto code) { std::memcpy(to, &code, sizeof code); };
  switch (type) {
    case PixelType::kUint8:
      return put(Code<uint8_t>(value, 255));
    case PixelType::kUint16:
      return put(Code<uint16_t>(value, 65535));
    case PixelType::kHalf:
      return put(base::HalfFromFloat(value));
    case PixelType::kFloat:
      return put(value);
  }
}

float Load(const std::byte* from, PixelType type) {
  const auto get = [from](auto code) {
    std::memcpy(&code, from, sizeof code);
    return code;
  };
  switch (type) {
    case PixelType::kUint8:
      return static_cast<float>(get(uint8_t{}) / 255.0);
    case PixelType::kUint16:
      return static_cast<float>(get(uint16_t{}) / 65535.0);
    case PixelType::kHalf:
      return base::FloatFromHalf(get(uint16_t{}));
    case PixelType::kFloat:
      break;
  }
  return get(float{});
}

std::string Shown(const std::vector<int>& sizes) {
  std::string text;
  for (const int n : sizes) text += (text.empty() ? "" : "x") + std::to_string(n);
  return text.empty() ? "none" : text;
}

// Of no context unless it is paged: tables are made before evaluations, and in those that have a context of
// their own.
std::shared_ptr<std::byte> Memory(size_t bytes) {
  if (auto paged = Context::Default().paged().Allocate(bytes)) return paged;
  const auto held = std::make_shared<base::Bytes>(bytes);
  return {held, reinterpret_cast<std::byte*>(held->data())};
}

}  // namespace

Table::Table(std::vector<int> sizes, int channels, std::span<const float> samples, TableAlign align,
             PixelType storage)
    : sizes_(std::move(sizes)), channels_(channels), storage_(storage), align_(align) {
  if (sizes_.empty() || sizes_.size() > 4) {
    throw Error("table", "found " + std::to_string(sizes_.size()) + " axes, expected 1 to 4");
  }
  if (channels < 1 || channels > 4) {
    throw Error("table", "found " + std::to_string(channels) + " result channels, expected 1 to 4");
  }
  int64_t count = 1;
  for (const int n : sizes_) {
    if (n < 1) throw Error("table", "found sizes " + Shown(sizes_) + ", expected at least 1 along each axis");
    count *= n;
    if (count > kMostEntries) {
      throw Error("table", "found sizes " + Shown(sizes_) + ", expected fewer than 2^31 entries");
    }
  }
  const size_t total = static_cast<size_t>(count) * static_cast<size_t>(channels);
  if (samples.size() != total) {
    throw Error("table", "found " + std::to_string(samples.size()) + " samples, expected " +
                             std::to_string(total) + " for sizes " + Shown(sizes_) + " and " +
                             std::to_string(channels) + " channels");
  }
  const size_t step = PixelBytes(storage);
  const std::shared_ptr<std::byte> memory = Memory(total * step);
  if (storage == PixelType::kFloat) {
    std::memcpy(memory.get(), samples.data(), total * step);
  } else {
    for (size_t i = 0; i < total; ++i) Store(samples[i], storage, memory.get() + i * step);
  }
  samples_ = memory;
}

int64_t Table::entries() const {
  if (empty()) return 0;
  int64_t count = 1;
  for (const int n : sizes_) count *= n;
  return count;
}

size_t Table::bytes() const {
  return static_cast<size_t>(entries()) * static_cast<size_t>(channels_) * PixelBytes(storage_);
}

float Table::At(int64_t index, int channel) const {
  return Load(samples_.get() + static_cast<size_t>(index * channels_ + channel) * PixelBytes(storage_),
              storage_);
}

std::vector<float> Table::Samples() const {
  std::vector<float> all(static_cast<size_t>(entries()) * static_cast<size_t>(channels_));
  if (storage_ == PixelType::kFloat && !all.empty()) {
    std::memcpy(all.data(), samples_.get(), bytes());
  } else {
    const size_t step = PixelBytes(storage_);
    for (size_t i = 0; i < all.size(); ++i) all[i] = Load(samples_.get() + i * step, storage_);
  }
  return all;
}

Table Table::WithStorage(PixelType storage) const {
  if (empty() || storage == storage_) return *this;
  return Table(sizes_, channels_, Samples(), align_, storage);
}

Table Table::WithAlign(TableAlign align) const {
  Table other = *this;
  other.align_ = align;
  return other;
}

}  // namespace tessera
