// Stored samples against reference values and what these may be off by.
#ifndef TESSERA_VERIFY_COMPARE_H_
#define TESSERA_VERIFY_COMPARE_H_

#include <vector>

#include "tessera/verify.h"
#include "verify/propagate.h"

namespace tessera::verify {

// Counts into a report.
class Comparison {
 public:
  Comparison(const StoredPixels& stored, VerifyReport& report) : stored_(stored), r_(report) {}

  // `pixels`: a tile as it was stored; `want`: the reference of the same pixels and all of its channels.
  void Tile(const ConstImageView& pixels, const Evaluated& want);
  void Finish();

 private:
  struct Place {
    int x, y, channel;
  };
  void Value(const Place& at, double got, double want, double tolerance);
  void Code(const Place& at, double got, double want, double tolerance);
  void Coarse(const Place& at, double got, double want, double tolerance, double rounding);
  bool Finite(const Place& at, double got, double want);
  void Count(double error, double allowed);
  // `excess`: the error in units of what is allowed.
  void Outside(const Place& at, double excess);
  double Rounded(double value) const;

  const StoredPixels& stored_;
  VerifyReport& r_;
  double excess_ = 0, squares_ = 0;
  int64_t finite_ = 0;
  std::vector<float> ratios_;
};

}  // namespace tessera::verify

#endif  // TESSERA_VERIFY_COMPARE_H_
