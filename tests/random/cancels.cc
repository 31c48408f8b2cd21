// Evaluations of random graphs that are cancelled at random moments: each ends as cancelled or with the right
// bits, leaves no file, and keeps no memory, thread or descriptor; the graph gives the same bits afterwards.
#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <thread>

#include "random/generate.h"
#include "tessera/context.h"
#include "tessera/error.h"
#include "tessera/io.h"
#include "tessera/render.h"

namespace tessera::random {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int kCancelsOfACase = 10;
constexpr double kMostSeconds = 0.5;  // of a case: others are skipped
// What libraries may keep of the second time that they see the same things.
constexpr int64_t kMayGrow = 256 << 10;

// Formats that tell the time tell this one.
const std::vector<Attribute> kAtNoTime = {{"DateTime", "string", {}, {"2001:02:03 04:05:06"}}};

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct Held {
  int64_t bytes = 0, threads = 0, descriptors = 0;
};

int64_t EntriesOf(const char* folder) {
  return std::distance(fs::directory_iterator(folder), fs::directory_iterator());
}

Held HeldNow() {
  Context::Default().Release();
  return {static_cast<int64_t>(mallinfo2().uordblks + mallinfo2().hblkhd), EntriesOf("/proc/self/task"),
          EntriesOf("/proc/self/fd")};
}

std::string Bytes(const Image& image) {
  const ImageSpec& s = image.spec();
  return {reinterpret_cast<const char*>(image.view().data),
          static_cast<size_t>(s.data_window.pixels() * s.channel_count()) * PixelBytes(s.type)};
}

std::string Contents(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// Cancels at a call of the callback, or at a time.
class Cancel {
 public:
  Cancel(Draw& draw, int calls, double seconds) {
    if (draw.Below(2) == 0) {
      at_ = draw.Between(1, calls);
      return;
    }
    const auto micros = static_cast<int64_t>(1e6 * draw.Real(0, 1.1 * seconds));
    timer_ = std::thread([this, micros] {
      std::this_thread::sleep_for(std::chrono::microseconds(micros));
      now_ = true;
    });
  }
  ~Cancel() {
    if (timer_.joinable()) timer_.join();
  }
  bool GoOn() { return !now_ && (at_ == 0 || ++calls_ < at_); }

 private:
  int64_t at_ = 0, calls_ = 0;
  std::atomic<bool> now_ = false;
  std::thread timer_;
};

struct Counts {
  int64_t cases = 0, skipped = 0, cancelled = 0, ended = 0, writes = 0, wrong = 0, left = 0;
};

class Canceller {
 public:
  Canceller(uint64_t seed, const std::string& folder)
      : seed_(seed), folder_(folder), generator_(RegistryRows(), folder, tally_) {
    fs::create_directories(folder + "/out");
  }

  // False where the case is of no use here.
  bool Run(uint64_t index, Counts& counts) {
    const Case c = generator_.Make(seed_, index);
    std::optional<Built> built;
    try {
      built = Build(c, index % 2 == 0 ? Backing::kView : Backing::kStreamed);
    } catch (const Error&) {
      return false;
    }
    Draw draw(seed_ + 1, index);
    RenderOptions options;
    options.threads = c.threads, options.tile_width = c.tile_width, options.tile_height = c.tile_height;
    std::string right;
    std::atomic<int> calls = 0;
    options.progress = [&calls](double) { return ++calls > 0; };
    const auto start = Clock::now();
    try {
      right = Bytes(Render(built->result(), c.type, options));
    } catch (const Error&) {
      return false;
    }
    const double seconds = SecondsSince(start);
    if (seconds > kMostSeconds) return false;
    ++counts.cases;
    const bool writes = draw.Below(4) == 0 && CanWrite(*built, c);
    for (int k = 0; k < kCancelsOfACase; ++k) {
      Cancel cancel(draw, std::max(calls.load(), 1), seconds);
      options.progress = [&cancel](double) { return cancel.GoOn(); };
      try {
        if (writes && k % 2 == 0) {
          ++counts.writes;
          WriteOnce(*built, c, options, counts);
        } else if (Bytes(Render(built->result(), c.type, options)) != right) {
          Report(counts.wrong, index, "other bits");
        }
        ++counts.ended;
      } catch (const Cancelled&) {
        ++counts.cancelled;
      } catch (const std::exception& e) {
        Report(counts.wrong, index, e.what());
      }
      if (writes) Look(index, counts);
    }
    if (writes) fs::remove(file_);
    options.progress = {};
    if (Bytes(Render(built->result(), c.type, options)) != right)
      Report(counts.wrong, index, "other bits afterwards");
    return true;
  }

 private:
  std::string FileOf(const Case& c) const {
    return folder_ + "/out/o." + (c.format.empty() ? "exr" : c.format);
  }
  bool CanWrite(const Built& built, const Case& c) {
    try {
      Write(built.result(), FileOf(c), {.type = c.type, .attributes = kAtNoTime, .sync = false});
      written_ = Contents(FileOf(c));
    } catch (const Error&) {
      fs::remove(FileOf(c));
      return false;
    }
    file_ = FileOf(c);
    std::ofstream(file_, std::ios::binary) << "old";
    return true;
  }
  void WriteOnce(const Built& built, const Case& c, const RenderOptions& options, Counts& counts) {
    Write(built.result(), file_, {.type = c.type, .render = options, .attributes = kAtNoTime, .sync = false});
    // A DPX holds the name that it was written by, which is not its own yet.
    if (Contents(file_) != written_ && c.format != "dpx")
      Report(counts.wrong, c.index, "another file: " + c.format);
    std::ofstream(file_, std::ios::binary) << "old";
  }
  void Look(uint64_t index, Counts& counts) {
    if (Contents(file_) != "old") Report(counts.wrong, index, "the old file is gone");
    if (EntriesOf((folder_ + "/out").c_str()) != 1) Report(counts.left, index, "files are left");
  }
  void Report(int64_t& count, uint64_t index, const std::string& what) const {
    if (++count < 20)
      std::printf("case %lld of seed %lld: %s\n", static_cast<long long>(index),
                  static_cast<long long>(seed_), what.c_str());
  }

  uint64_t seed_;
  std::string folder_, file_, written_;
  Tally tally_;
  Generator generator_;
};

int Main(int argc, char** argv) {
  int64_t count = 10000;
  uint64_t seed = 1;
  for (int i = 1; i < argc; i += 2) {
    const std::string word = argv[i];
    if (i + 1 == argc || (word != "--count" && word != "--seed")) {
      std::fprintf(stderr,
                   "cancels [--count N] [--seed S]\nN evaluations are cancelled; 10000 by default.\n");
      return 2;
    }
    const int64_t value = std::atoll(argv[i + 1]);
    if (word == "--count") count = value;
    if (word == "--seed") seed = static_cast<uint64_t>(value);
  }
  std::string folder = (fs::temp_directory_path() / "tessera-cancels-XXXXXX").string();
  if (::mkdtemp(folder.data()) == nullptr) return 2;
  Canceller canceller(seed, folder);
  Counts counts;
  Held before;
  int64_t grown = 0, threads = 0, descriptors = 0;
  // The same cases twice: what the first time leaves behind (threads, caches, names) is there the second
  // time.
  uint64_t cases = 0;
  while (counts.cancelled < (count + 1) / 2) counts.skipped += canceller.Run(cases++, counts) ? 0 : 1;
  before = HeldNow();
  while (counts.cancelled < count) {
    for (uint64_t i = 0; i < cases; ++i) canceller.Run(i, counts);
    const Held after = HeldNow();
    grown = after.bytes - before.bytes, threads = after.threads - before.threads;
    descriptors = after.descriptors - before.descriptors;
    before = after;
  }
  fs::remove_all(folder);
  const auto number = [](int64_t n) { return static_cast<long long>(n); };
  std::printf(
      "cancelled %lld of %lld evaluations, %lld of them writes, of %lld graphs (%lld not used); wrong %lld, "
      "files left %lld; the second time: bytes %+lld, threads %+lld, descriptors %+lld\n",
      number(counts.cancelled), number(counts.cancelled + counts.ended), number(counts.writes),
      number(counts.cases), number(counts.skipped), number(counts.wrong), number(counts.left), number(grown),
      number(threads), number(descriptors));
  const bool kept = grown > kMayGrow || threads > 0 || descriptors > 0;
  return counts.wrong > 0 || counts.left > 0 || kept ? 1 : 0;
}

}  // namespace
}  // namespace tessera::random

int main(int argc, char** argv) { return tessera::random::Main(argc, argv); }
