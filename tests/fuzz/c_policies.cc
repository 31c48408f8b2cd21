// Policies and files of the C interface: calls of 16 bytes each, beside a model that says how each must end.
#include <cmath>
#include <filesystem>
#include <optional>

#include "fuzz/fuzz.h"
#include "random/draw.h"
#include "tessera/c.h"

using namespace tessera;

namespace {

namespace fs = std::filesystem;

constexpr size_t kCallBytes = 16, kMostCalls = 24;
constexpr int kMostSide = 12, kMostChannels = 3;
enum Format { kPng, kTiff, kExr, kFits, kFormats };  // of the last no reader is stood behind
enum What { kSet, kSetNone, kGet, kSafe, kWrite, kWriteLink, kCancel, kRead, kLate, kHanging, kWhats };

// What is in a file.
struct Written {
  int width = 0, height = 0, channels = 0;
  std::vector<float> samples;
};

struct Model {
  tessera_policy policy = TESSERA_INIT(tessera_policy);
  std::optional<Written> files[kFormats];
  tessera_image* late = nullptr;  // opened under some policy, or null

  ~Model() { tessera_image_free(late); }
};

std::string PathOf(Format format) {
  static const char* const kExtensions[] = {"png", "tif", "exr", "fits"};
  return fuzz::Folder() + "/policy." + kExtensions[format];
}

template <typename Call>
tessera_status StatusOf(const Call& call) {
  tessera_error* error = nullptr;
  const tessera_status status = call(&error);
  fuzz::Require(status >= TESSERA_OK && status <= TESSERA_CANCELLED, "a fault of the library, or no status");
  fuzz::Require((status == TESSERA_OK) == (error == nullptr),
                "a status without an error, or the other way round");
  fuzz::Require(error == nullptr || *tessera_error_reason(error) != 0, "an error without a reason");
  tessera_error_free(error);
  return status;
}

bool IsSize(size_t size) { return size >= sizeof(size_t) && size <= 4096; }

// A limit: none, few, many, any.
int64_t LimitOf(fuzz::Input& in) {
  switch (in.Below(4)) {
    case 0:
      return 0;
    case 1:
      return in.Take<uint8_t>();
    case 2:
      return in.Take<int32_t>();
    default:
      return int64_t{in.Take<int16_t>()} << 48;
  }
}

void Set(fuzz::Input& in, Model& m) {
  constexpr double kSeconds[] = {0, 1, 1e300, -1, NAN, INFINITY};
  tessera_policy p = TESSERA_INIT(tessera_policy);
  p.listed_formats = in.Below(2), p.configs_inside = in.Below(2), p.no_output_links = in.Below(2);
  p.sandbox = in.Below(3) > 0 ? 0 : in.Take<int8_t>() % 4;
  p.pixels = LimitOf(in);
  p.channels = in.Below(2) == 0 ? 0 : in.Take<int8_t>();
  p.reader_seconds = kSeconds[in.Below(6)];
  p.reader_memory = in.Below(4) == 0 ? LimitOf(in) : 0;
  if (in.Below(3) == 0) p.struct_size = in.Take<uint16_t>();
  // What a library that knows no more than struct_size sees.
  tessera_policy seen = {};
  if (IsSize(p.struct_size)) std::memcpy(static_cast<void*>(&seen), &p, std::min(p.struct_size, sizeof p));
  const bool right = IsSize(p.struct_size) && seen.pixels >= 0 && seen.channels >= 0 && seen.sandbox >= 0 &&
                     seen.sandbox <= TESSERA_SANDBOX_ALL && seen.reader_memory >= 0 &&
                     seen.reader_seconds >= 0;
  // The structure at the end of what may be read.
  std::vector<char> bytes(std::clamp<size_t>(p.struct_size, sizeof(size_t), sizeof p));
  std::memcpy(bytes.data(), &p, bytes.size());
  const auto* const given =
      p.struct_size <= sizeof p ? reinterpret_cast<const tessera_policy*>(bytes.data()) : &p;
  const tessera_status status = StatusOf([&](tessera_error** e) { return tessera_set_policy(given, e); });
  fuzz::Require(status == (right ? TESSERA_OK : TESSERA_USAGE),
                "a policy that is taken, or refused, wrongly");
  if (right) m.policy = seen;
}

// As much of a structure as there is, and nothing behind it.
void Get(fuzz::Input& in, const Model& m, bool safe) {
  constexpr size_t kRoom = 4096;
  alignas(tessera_policy) char room[kRoom];
  std::memset(room, 0x5a, sizeof room);
  const size_t size = in.Below(2) == 0 ? sizeof(tessera_policy) : in.Take<uint16_t>() % (kRoom + 100);
  std::memcpy(room, &size, sizeof size);
  auto* const policy = reinterpret_cast<tessera_policy*>(room);
  const tessera_status status = StatusOf([&](tessera_error** e) {
    return safe ? tessera_safe_policy(policy, e) : tessera_get_policy(policy, e);
  });
  fuzz::Require(status == (IsSize(size) ? TESSERA_OK : TESSERA_USAGE), "a structure of a wrong size");
  const size_t filled = status == TESSERA_OK ? std::min(size, sizeof(tessera_policy)) : sizeof size;
  fuzz::Require(std::all_of(room + filled, room + kRoom, [](char c) { return c == 0x5a; }),
                "bytes written behind a structure");
  if (status != TESSERA_OK || safe || filled < sizeof(tessera_policy)) return;
  const tessera_policy& p = m.policy;
  fuzz::Require(policy->pixels == p.pixels && policy->channels == p.channels &&
                    (policy->listed_formats != 0) == (p.listed_formats != 0) &&
                    (policy->configs_inside != 0) == (p.configs_inside != 0) &&
                    (policy->no_output_links != 0) == (p.no_output_links != 0) &&
                    policy->sandbox == p.sandbox && policy->reader_memory == p.reader_memory &&
                    policy->reader_seconds == p.reader_seconds,
                "a policy that is not the one that was set");
}

// Codes that every format holds exactly.
Written DrawnPicture(fuzz::Input& in) {
  Written w;
  w.width = 1 + in.Take<uint8_t>() % kMostSide, w.height = 1 + in.Take<uint8_t>() % kMostSide;
  w.channels = in.Below(2) == 0 ? 1 : kMostChannels;  // no alpha, which some formats do not multiply by
  w.samples.resize(static_cast<size_t>(w.width * w.height * w.channels));
  uint32_t state = in.Take<uint16_t>() + 1u;
  for (float& s : w.samples) state = state * 1664525u + 1013904223u, s = static_cast<float>(state >> 31);
  return w;
}

tessera_pixels PixelsOf(const Written& w, float* data) {
  tessera_pixels pixels = TESSERA_INIT(tessera_pixels);
  pixels.data = data;
  pixels.window = {0, 0, w.width, w.height};
  pixels.channels = w.channels, pixels.type = TESSERA_FLOAT;
  return pixels;
}

struct Cancelling {
  int left = 0;
  bool cancelled = false;
};
int32_t CountDown(double share, void* user) {
  fuzz::Require(share >= 0 && share <= 1, "a share done of less than nothing or more than all");
  auto& c = *static_cast<Cancelling*>(user);
  c.cancelled |= c.left-- <= 0;
  return c.cancelled ? 0 : 1;
}

void Write(fuzz::Input& in, Model& m, bool cancel) {
  const auto format = static_cast<Format>(in.Below(kFormats));
  Written w = DrawnPicture(in);
  const tessera_pixels pixels = PixelsOf(w, w.samples.data());
  tessera_image* image = nullptr;
  fuzz::Require(StatusOf([&](tessera_error** e) {
                  return tessera_image_copy(&pixels, nullptr, &image, e);
                }) == TESSERA_OK,
                "a picture that is refused");
  tessera_write_options options = TESSERA_INIT(tessera_write_options);
  options.type = format == kExr ? TESSERA_HALF : format == kFits ? TESSERA_FLOAT : TESSERA_UINT8;
  options.threads = 1;
  Cancelling cancelling{static_cast<int>(in.Below(4))};
  if (cancel) options.progress = CountDown, options.user = &cancelling;
  const tessera_status status =
      StatusOf([&](tessera_error** e) { return tessera_write(image, PathOf(format).c_str(), &options, e); });
  tessera_image_free(image);
  if (format == kFits && m.policy.listed_formats) {
    fuzz::Require(status == TESSERA_DATA, "a format off the list that is written");
  } else if (cancelling.cancelled) {
    fuzz::Require(status == TESSERA_CANCELLED, "an evaluation that goes on when cancelled");
  } else if (format != kFits) {
    fuzz::Require(status == TESSERA_OK, "a picture that is not written");
  }
  if (status == TESSERA_OK) m.files[format] = std::move(w);
}

// By a name that is a link, which is followed or refused.
void WriteLink(fuzz::Input& in, Model& m) {
  const std::string link = fuzz::Folder() + "/policy.link.png";
  fs::remove(link);
  fs::create_symlink(PathOf(kPng), link);
  Written w = DrawnPicture(in);
  const tessera_pixels pixels = PixelsOf(w, w.samples.data());
  tessera_image* image = nullptr;
  StatusOf([&](tessera_error** e) { return tessera_image_copy(&pixels, nullptr, &image, e); });
  const tessera_status status =
      StatusOf([&](tessera_error** e) { return tessera_write(image, link.c_str(), nullptr, e); });
  tessera_image_free(image);
  fuzz::Require(status == (m.policy.no_output_links ? TESSERA_DATA : TESSERA_OK),
                "a link that is followed, or refused, wrongly");
  fs::remove(link);
  if (status != TESSERA_OK) return;
  fs::remove(PathOf(kPng));
  m.files[kPng].reset();
}

// The ways in which reading may fail under the policy that holds, a bit each.
int Refusals(const Model& m, Format format, bool all_formats) {
  int refusals = 0;
  const std::optional<Written>& file = m.files[format];
  if (!file || (format == kFits && (!all_formats || m.policy.listed_formats))) refusals |= 1 << TESSERA_DATA;
  if (file && m.policy.pixels > 0 && int64_t{file->width} * file->height > m.policy.pixels)
    refusals |= 1 << TESSERA_DATA;
  if (file && m.policy.channels > 0 && file->channels > m.policy.channels) refusals |= 1 << TESSERA_DATA;
  // No sandbox was started.
  if (m.policy.sandbox == TESSERA_SANDBOX_ALL ||
      (m.policy.sandbox == TESSERA_SANDBOX_UNLISTED && format == kFits))
    refusals |= 1 << TESSERA_SYSTEM;
  return refusals;
}

void Read(fuzz::Input& in, Model& m, bool late) {
  const auto format = static_cast<Format>(in.Below(kFormats));
  tessera_read_options options = TESSERA_INIT(tessera_read_options);
  options.all_formats = static_cast<int32_t>(in.Below(2));
  tessera_image* image = nullptr;
  tessera_status status =
      StatusOf([&](tessera_error** e) { return tessera_read(PathOf(format).c_str(), &options, &image, e); });
  const int refusals = Refusals(m, format, options.all_formats != 0);
  fuzz::Require((status == TESSERA_OK) == (image != nullptr), "an image after a failure, or none");
  fuzz::Require(refusals == 0 ? status == TESSERA_OK : (refusals >> status & 1) != 0,
                "a file that is read, or refused, wrongly");
  if (image == nullptr) return;
  if (late) {  // its pixels under another policy
    tessera_image_free(m.late);
    m.late = image;
    return;
  }
  const Written& want = *m.files[format];
  tessera_image_info info = TESSERA_INIT(tessera_image_info);
  status = StatusOf([&](tessera_error** e) { return tessera_image_get_info(image, &info, e); });
  fuzz::Require(status == TESSERA_OK && info.channels == want.channels &&
                    info.data_window.x1 - info.data_window.x0 == want.width &&
                    info.data_window.y1 - info.data_window.y0 == want.height,
                "an image of another size than was written");
  std::vector<float> got(want.samples.size());
  tessera_pixels pixels = PixelsOf(want, got.data());
  pixels.window = info.data_window;
  status = StatusOf([&](tessera_error** e) { return tessera_render(image, &pixels, nullptr, e); });
  tessera_image_free(image);
  fuzz::Require(status == TESSERA_OK, "pixels that are not read");
  // FITS has them upside down, and knows no more than numbers.
  fuzz::Require(format == kFits || got == want.samples, "other pixels than were written");
}

void RenderLate(const Model& m) {
  if (m.late == nullptr) return;
  tessera_image_info info = TESSERA_INIT(tessera_image_info);
  StatusOf([&](tessera_error** e) { return tessera_image_get_info(m.late, &info, e); });
  std::vector<float> got(size_t{kMostSide} * kMostSide * kMostChannels);
  tessera_pixels pixels = TESSERA_INIT(tessera_pixels);
  pixels.data = got.data(), pixels.window = info.data_window;
  pixels.channels = info.channels, pixels.type = TESSERA_FLOAT;
  // The file, or what may be read, is another by now: any answer, but in words.
  StatusOf([&](tessera_error** e) { return tessera_render(m.late, &pixels, nullptr, e); });
}

void Call(fuzz::Input in, Model& m) {
  switch (in.Take<uint8_t>() % kWhats) {
    case kSet:
      return Set(in, m);
    case kSetNone:
      StatusOf([](tessera_error** e) { return tessera_set_policy(nullptr, e); });
      m.policy = TESSERA_INIT(tessera_policy);
      return;
    case kGet:
      return Get(in, m, false);
    case kSafe:
      return Get(in, m, true);
    case kWrite:
      return Write(in, m, false);
    case kWriteLink:
      return WriteLink(in, m);
    case kCancel:
      return Write(in, m, true);
    case kRead:
      return Read(in, m, false);
    case kLate:
      return Read(in, m, true);
    default:
      return RenderLate(m);
  }
}

}  // namespace

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  std::vector<std::string> seeds;
  const auto call = [](std::initializer_list<int> bytes) {
    std::string text(kCallBytes, '\0');
    std::copy(bytes.begin(), bytes.end(), text.begin());
    return text;
  };
  for (int format = 0; format < kFormats; ++format) {
    const std::string write = call({kWrite, format, 6, 5, 2, 9}), read = call({kRead, format, 1});
    for (const std::string& set : {call({kSetNone}), call({kSet, 1}), call({kSet, 0, 0, 1, 1}),
                                   call({kSet, 0, 0, 0, 0, 1}), call({kSet, 0, 0, 0, 0, 2}),
                                   call({kSet, 0, 0, 0, 1, 1, 20, 0}), call({kSet, 0, 0, 0, 1, 0, 1, 2})}) {
      std::string late = read;
      late[0] = kLate;
      seeds.push_back(write + read + late + set + call({kGet}) + read + write + call({kHanging}));
    }
    seeds.push_back(write + call({kCancel, format, 3, 3, 1, 0, 0, 0}) + read + call({kWriteLink, 4, 4, 1}) +
                    read);
  }
  return seeds;
}
std::vector<std::string> Words() { return {}; }
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  StatusOf([](tessera_error** e) { return tessera_set_policy(nullptr, e); });
  for (int f = 0; f < kFormats; ++f) fs::remove(PathOf(static_cast<Format>(f)));
  Model model;
  for (size_t at = 0, calls = 0; at < size && calls < kMostCalls; at += kCallBytes, ++calls)
    Call(fuzz::Input(data + at, std::min(kCallBytes, size - at)), model);
  for (const auto& entry : fs::directory_iterator(fuzz::Folder()))
    fuzz::Require(!entry.path().filename().string().starts_with("."), "a temporary file that is left");
  StatusOf([](tessera_error** e) { return tessera_set_policy(nullptr, e); });
  return 0;
}

// A call more, one less, two in another order, one twice, one with another byte.
extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t most, unsigned seed) {
  random::Draw draw(seed, 2);
  std::vector<std::string> calls;
  for (size_t at = 0; at < size; at += kCallBytes) {
    calls.emplace_back(reinterpret_cast<const char*>(data) + at, std::min(kCallBytes, size - at));
    calls.back().resize(kCallBytes);
  }
  const auto at = [&](size_t n) { return calls.begin() + draw.Below(static_cast<int>(n)); };
  switch (calls.empty() ? 0 : draw.Below(5)) {
    case 0: {
      std::string made;
      while (made.size() < kCallBytes)
        made += static_cast<char>(draw.Chance(0.5) ? draw.Below(4) : draw.Below(256));
      made[0] = static_cast<char>(draw.Below(kWhats));
      calls.insert(at(calls.size() + 1), made);
      break;
    }
    case 1:
      calls.erase(at(calls.size()));
      break;
    case 2:
      std::iter_swap(at(calls.size()), at(calls.size()));
      break;
    case 3: {
      const std::string call = *at(calls.size());
      calls.insert(at(calls.size() + 1), call);
      break;
    }
    default:
      (*at(calls.size()))[static_cast<size_t>(draw.Below(kCallBytes))] = static_cast<char>(draw.Below(256));
  }
  std::string all;
  for (const std::string& call : calls) all += call;
  all.resize(std::min(all.size(), most / kCallBytes * kCallBytes));
  std::copy(all.begin(), all.end(), data);
  return all.size();
}
