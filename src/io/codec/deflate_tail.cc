// Walks over the symbols of a deflate stream: only their lengths matter.
#include "io/codec/deflate_tail.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace tessera::io {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr int kLongestCode = 15, kSymbols = 288, kDistances = 32, kEndOfBlock = 256;

class Bits {
 public:
  explicit Bits(std::span<const uint8_t> bytes) : bytes_(bytes) {}

  // At least 56 bits are there after it, zeros behind the end.
  void Refill() {
    if (next_ + 8 <= bytes_.size()) {
      uint64_t word;
      std::memcpy(&word, bytes_.data() + next_, 8);
      held_ |= word << count_;
      next_ += static_cast<size_t>(63 - count_) >> 3;
      count_ |= 56;
      return;
    }
    for (; count_ <= 56; count_ += 8, ++next_) {
      if (next_ < bytes_.size()) held_ |= static_cast<uint64_t>(bytes_[next_]) << count_;
    }
  }
  uint64_t Peek() const { return held_; }
  void Skip(int n) {
    held_ >>= n;
    count_ -= n;
  }
  int Take(int n) {
    const int value = static_cast<int>(held_ & ((uint64_t{1} << n) - 1));
    Skip(n);
    return value;
  }
  size_t Position() const { return next_ * 8 - static_cast<size_t>(count_); }
  bool Beyond() const { return Position() > bytes_.size() * 8; }
  void Seek(size_t byte) {
    next_ = byte;
    held_ = 0;
    count_ = 0;
  }

 private:
  std::span<const uint8_t> bytes_;
  size_t next_ = 0;
  uint64_t held_ = 0;
  int count_ = 0;
};

// A prefix code. What a look-up of the next bits finds: how far to go, and whether it ends a run of literals.
class Code {
 public:
  enum Kind : uint8_t { kLiterals, kOther, kLong };
  struct Entry {
    uint8_t bits;    // of the code or codes
    Kind kind;       // kLong: the code is longer than the table's index
    int16_t symbol;  // of kOther
  };

  // False for lengths that are no code. A single code of one bit is allowed to be incomplete, as is none at
  // all.
  bool Build(std::span<const uint8_t> lengths, int table_bits, int literals) {
    count_.fill(0);
    for (const uint8_t length : lengths) ++count_[length];
    const bool none = count_[0] == static_cast<int>(lengths.size());
    count_[0] = 0;
    int left = 1, used = 0;
    for (int length = 1; length <= kLongestCode; ++length) {
      left = left * 2 - count_[static_cast<size_t>(length)];
      if (left < 0) return false;
      used += count_[static_cast<size_t>(length)];
    }
    if (left != 0 && !none && !(used == 1 && count_[1] == 1)) return false;
    std::array<int, kLongestCode + 2> offset{};
    for (size_t length = 1; length <= kLongestCode; ++length)
      offset[length + 1] = offset[length] + count_[length];
    std::array<int, kLongestCode + 2> place = offset;
    for (size_t s = 0; s < lengths.size(); ++s) {
      if (lengths[s] != 0) symbols_[static_cast<size_t>(place[lengths[s]]++)] = static_cast<int16_t>(s);
    }
    table_bits_ = table_bits;
    FillTable(offset, literals);
    return true;
  }

  Entry Find(uint64_t bits) const { return table_[bits & ((size_t{1} << table_bits_) - 1)]; }

  // A code longer than the table's index, or -1.
  int FindLong(uint64_t bits, int& length) const {
    int code = 0, first = 0, index = 0;
    for (length = 1; length <= kLongestCode; ++length, bits >>= 1) {
      code |= static_cast<int>(bits & 1);
      const int count = count_[static_cast<size_t>(length)];
      if (code - count < first) return symbols_[static_cast<size_t>(index + code - first)];
      index += count;
      first = (first + count) * 2;
      code *= 2;
    }
    return -1;
  }

 private:
  void FillTable(const std::array<int, kLongestCode + 2>& offset, int literals) {
    const size_t size = size_t{1} << table_bits_;
    std::fill_n(table_.begin(), size, Entry{0, kLong, 0});
    unsigned code = 0;
    for (int length = 1; length <= table_bits_; ++length, code <<= 1) {
      for (int i = 0; i < count_[static_cast<size_t>(length)]; ++i, ++code) {
        const int16_t symbol = symbols_[static_cast<size_t>(offset[static_cast<size_t>(length)] + i)];
        unsigned reversed = 0;
        for (int b = 0; b < length; ++b) reversed |= (code >> b & 1) << (length - 1 - b);
        for (size_t at = reversed; at < size; at += size_t{1} << length)
          table_[at] = {static_cast<uint8_t>(length), symbol < literals ? kLiterals : kOther, symbol};
      }
    }
    if (literals == 0) return;
    // Several literals by one look-up. Entries of fewer bits are behind those that look them up.
    const std::array<Entry, 1 << kMostTableBits> single = table_;
    for (size_t at = 0; at < size; ++at) {
      Entry& entry = table_[at];
      while (entry.kind == kLiterals) {
        const Entry next = single[at >> entry.bits];
        if (next.kind != kLiterals || entry.bits + next.bits > table_bits_) break;
        entry.bits = static_cast<uint8_t>(entry.bits + next.bits);
      }
    }
  }

  static constexpr int kMostTableBits = 11;
  int table_bits_ = 0;
  std::array<Entry, 1 << kMostTableBits> table_;
  std::array<int, kLongestCode + 1> count_;
  std::array<int16_t, kSymbols> symbols_;
};

constexpr std::array<uint8_t, 29> kLengthExtra = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2,
                                                  2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 0};

class Walk {
 public:
  explicit Walk(std::span<const uint8_t> stream) : stream_(stream), bits_(stream) {}

  std::optional<DeflateTail> Run() {
    DeflateTail tail;
    for (bool last = false; !last;) {
      bits_.Refill();
      tail.last_block = bits_.Position();
      last = bits_.Take(1) != 0;
      const int type = bits_.Take(2);
      const bool ok = type == 0   ? Stored()
                      : type == 1 ? FixedCodes() && Symbols()
                                  : type == 2 && OwnCodes() && Symbols();
      if (!ok || bits_.Beyond()) return std::nullopt;
    }
    tail.end = bits_.Position();
    return tail;
  }

 private:
  bool Stored() {
    const size_t at = (bits_.Position() + 7) / 8;
    if (at + 4 > stream_.size()) return false;
    const unsigned length = stream_[at] | static_cast<unsigned>(stream_[at + 1]) << 8;
    const unsigned check = stream_[at + 2] | static_cast<unsigned>(stream_[at + 3]) << 8;
    if ((length ^ check) != 0xFFFF || at + 4 + length > stream_.size()) return false;
    bits_.Seek(at + 4 + length);
    return true;
  }

  bool FixedCodes() {
    std::array<uint8_t, kSymbols> lengths;
    for (size_t s = 0; s < kSymbols; ++s) lengths[s] = s < 144 ? 8 : s < 256 ? 9 : s < 280 ? 7 : 8;
    std::array<uint8_t, kDistances> distances;
    distances.fill(5);
    return symbols_.Build(lengths, 11, kEndOfBlock) && distances_.Build(distances, 9, 0);
  }

  bool OwnCodes() {
    constexpr std::array<uint8_t, 19> kOrder = {16, 17, 18, 0, 8,  7, 9,  6, 10, 5,
                                                11, 4,  12, 3, 13, 2, 14, 1, 15};
    bits_.Refill();
    const size_t symbols = static_cast<size_t>(bits_.Take(5)) + 257,
                 distances = static_cast<size_t>(bits_.Take(5)) + 1;
    const size_t codes = static_cast<size_t>(bits_.Take(4)) + 4;
    if (symbols > 286) return false;
    std::array<uint8_t, 19> of_lengths{};
    for (size_t i = 0; i < codes; ++i) {
      if (i % 8 == 0) bits_.Refill();
      of_lengths[kOrder[i]] = static_cast<uint8_t>(bits_.Take(3));
    }
    if (!distances_.Build(of_lengths, 7, 0)) return false;
    std::array<uint8_t, kSymbols + kDistances> lengths{};
    for (size_t i = 0; i < symbols + distances;) {
      bits_.Refill();
      const Code::Entry entry = distances_.Find(bits_.Peek());
      if (entry.bits == 0 || bits_.Beyond()) return false;
      bits_.Skip(entry.bits);
      if (entry.symbol < 16) {
        lengths[i++] = static_cast<uint8_t>(entry.symbol);
        continue;
      }
      if (entry.symbol == 16 && i == 0) return false;
      const uint8_t value = entry.symbol == 16 ? lengths[i - 1] : uint8_t{0};
      const size_t repeat = static_cast<size_t>(entry.symbol == 16   ? 3 + bits_.Take(2)
                                                : entry.symbol == 17 ? 3 + bits_.Take(3)
                                                                     : 11 + bits_.Take(7));
      if (i + repeat > symbols + distances) return false;
      std::fill_n(lengths.begin() + static_cast<ptrdiff_t>(i), repeat, value);
      i += repeat;
    }
    if (lengths[kEndOfBlock] == 0) return false;
    const std::span<const uint8_t> all(lengths);
    return symbols_.Build(all.first(symbols), 11, kEndOfBlock) &&
           distances_.Build(all.subspan(symbols, distances), 9, 0);
  }

  bool Symbols() {
    for (;;) {
      bits_.Refill();
      Code::Entry entry = symbols_.Find(bits_.Peek());
      for (int i = 0; i < 4 && entry.kind == Code::kLiterals; ++i) {
        bits_.Skip(entry.bits);
        entry = symbols_.Find(bits_.Peek());
      }
      if (entry.kind == Code::kLiterals) {
        if (bits_.Beyond()) return false;
        continue;
      }
      bits_.Refill();
      int length = entry.bits, symbol = entry.symbol;
      if (entry.kind == Code::kLong) symbol = symbols_.FindLong(bits_.Peek(), length);
      if (symbol < 0 || bits_.Beyond()) return false;
      bits_.Skip(length);
      if (symbol < kEndOfBlock) continue;
      if (symbol == kEndOfBlock) return true;
      if (symbol > 285) return false;
      bits_.Skip(kLengthExtra[static_cast<size_t>(symbol - 257)]);
      const Code::Entry distance = distances_.Find(bits_.Peek());
      length = distance.bits;
      symbol = distance.symbol;
      if (distance.kind == Code::kLong) symbol = distances_.FindLong(bits_.Peek(), length);
      if (symbol < 0 || symbol > 29) return false;
      bits_.Skip(length);
      bits_.Skip(symbol < 4 ? 0 : symbol / 2 - 1);
    }
  }

  std::span<const uint8_t> stream_;
  Bits bits_;
  Code symbols_, distances_;
};

}  // namespace

std::optional<DeflateTail> FindDeflateTail(std::span<const uint8_t> stream) { return Walk(stream).Run(); }

}  // namespace tessera::io
