// The oracle: one plain double-precision function per operation, one loop, no cleverness, written
// independently of the kernels. Serves tests, benchmarks and --verify.
#ifndef TESSERA_REFERENCE_REFERENCE_H_
#define TESSERA_REFERENCE_REFERENCE_H_

#include <any>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "tessera/image.h"

namespace tessera::reference {

// Interleaved doubles over a region.
struct ImageD {
  Roi roi;
  int channels = 0;
  std::vector<double> samples;

  ImageD() = default;
  ImageD(const Roi& r, int n) : roi(r), channels(n), samples(static_cast<size_t>(r.pixels()) * n) {}
  double& at(int x, int y, int c) { return samples[Index(x, y, c)]; }
  double at(int x, int y, int c) const { return samples[Index(x, y, c)]; }

 private:
  size_t Index(int x, int y, int c) const {
    return (static_cast<size_t>(y - roi.y0) * roi.width() + (x - roi.x0)) * channels + c;
  }
};

// The size of a jump that nobody has measured.
inline constexpr double kUnknownJump = 1e30;
// The same, of a sample that may be infinite or no number instead: times 0 it is not 0.
inline constexpr double kEndlessJump = std::numeric_limits<double>::infinity();

// What a reference function is given. `out` has its roi set; in[k] covers the region input_roi asked for
// (out.roi for point operations). `scale`, when not null, has out's shape and receives what the operation's
// bound is a multiple of (doc/accuracy.md: S = sum |w x| for a weighted sum, max |RGB| for hue,
// |result| for one rounding): bound = OpInfo::bound_u * 2^-24 * scale.
struct Call {
  const std::any& parameters;  // the op's parameter struct
  std::span<const ImageD> in;
  std::span<const ImageSpec> in_specs;
  const ImageSpec& out_spec;
  ImageD& out;
  ImageD* scale;
  // When not null, has out's shape, zeros at first: where a result hangs on a decision that float32 may take
  // the other way (a hit or a miss, a test, a nearest entry, how many steps), how far the other result lies
  // from this one, or kUnknownJump or kEndlessJump. Such a value is undecided: it neither passes nor fails.
  ImageD* undecided = nullptr;
  // How far the samples of each input may be off, same shapes as `in`; empty where they are exact. Only for
  // judging decisions: how errors of inputs pass through an operation is tried out by those who ask.
  std::span<const ImageD> tolerances = {};
  // The largest finite magnitude of each whole input, channels together, 0 where nobody asked (Entry's
  // wants_largest); may be empty.
  std::span<const double> largest = {};
  // Throws where there is no time left. Asked by references whose pixels take long.
  const std::function<void()>* check = nullptr;

  void Check() const {
    if (check != nullptr) (*check)();
  }
  void Undecided(int x, int y, int c, double jump) const {
    if (undecided == nullptr) return;
    double& most = undecided->at(x, y, c);
    if (!(jump <= most)) most = jump;
  }
  void Undecided(int x, int y, double jump = kUnknownJump) const {  // every channel
    for (int c = 0; undecided != nullptr && c < out.channels; ++c) Undecided(x, y, c, jump);
  }
  double Tolerance(int k, int x, int y, int c) const {
    return tolerances.empty() ? 0.0 : tolerances[static_cast<size_t>(k)].at(x, y, c);
  }
};
using Function = void (*)(const Call&);

// A weighted sum over an image of any size, which comes in bands: so it need not be in memory, in double,
// whole. What samples may be off by passes through as the same sum of that.
class Reduction {
 public:
  virtual ~Reduction() = default;
  virtual void Take(const ImageD& band) = 0;
  // `scale` as in Call, may be null.
  virtual void Give(ImageD& out, ImageD* scale) const = 0;
};
using InputRoiFunction = Roi (*)(const std::any& parameters, int input, const Roi& out);
using SizedRoiFunction = Roi (*)(const std::any& parameters, const ImageSpec& in, const Roi& out);

struct Entry {
  std::string op;  // Op::Name()
  Function evaluate = nullptr;
  InputRoiFunction input_roi = nullptr;  // null for point operations
  // Bit k: the result is a weighted sum of input k's samples and `scale` holds the sum of |weight * sample|,
  // so that the errors of the samples pass through as that sum. Of other operations the response is tried
  // out.
  uint32_t weighted_sum_of = 0;
  // What a reader of a comparison has to know about this entry, or nothing.
  std::string remark = {};
  // Asked in place of input_roi where the region of the one input depends on that image's size as well.
  SizedRoiFunction sized_roi = nullptr;
  // Whether rows of the result cost what they cost, each by itself: then they may be asked for one at a time.
  bool by_rows = false;
  // Whether an input's largest sample anywhere is part of the bound: recursive filters run along whole lines.
  bool (*wants_largest)(const std::any& parameters, int input) = nullptr;
  // Asked in place of `evaluate` where the one input is reduced whole.
  std::unique_ptr<Reduction> (*reduction)(const ImageSpec& input) = nullptr;

  // The region of input k that a region of the result comes from.
  Roi InputRoi(const std::any& parameters, int k, const ImageSpec& in, const Roi& out) const {
    if (sized_roi != nullptr) return sized_roi(parameters, in, out);
    return input_roi != nullptr ? input_roi(parameters, k, out) : out;
  }
};

// The entry of an operation, or null. Shuffles, crops and sources need none.
const Entry* Find(const std::string& op);
// Adds or replaces an entry: for tests that bring operations of their own.
void Register(Entry entry);

}  // namespace tessera::reference

#endif  // TESSERA_REFERENCE_REFERENCE_H_
