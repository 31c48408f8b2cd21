// The named transfer functions as formulas, each with its exact inverse.
#include <cmath>

#include "tessera/error.h"
#include "tessera/ops/curve.h"

namespace tessera {
namespace {

using Kind = CurveFormula::Kind;

constexpr double kLog2Of10 = 3.3219280948873623479;
constexpr double kLowestArgument = 0x1p-126;  // keeps logarithms of nothing finite, as OpenColorIO does

// log_scale log10(in_scale x + in_offset) + log_offset from `join` on, below it a line that meets it there.
CurveFormula CameraLog(double log_scale, double log_offset, double in_scale, double in_offset, double join,
                       double slope) {
  CurveFormula f;
  f.kind = Kind::kLog;
  f.in_scale = in_scale, f.in_offset = in_offset, f.floor = kLowestArgument;
  f.out_scale = log_scale / kLog2Of10, f.out_offset = log_offset;
  f.join = join, f.slope = slope;
  f.offset = f.out_scale * std::log2(in_scale * join + in_offset) + log_offset - slope * join;
  return f;
}

// The slope at the join, for curves that are smooth there by definition.
double SlopeAt(double log_scale, double in_scale, double in_offset, double join) {
  return log_scale * in_scale / ((in_scale * join + in_offset) * std::log(10.0));
}

// out_scale x^exponent + 1 - out_scale from `join` on, slope x below.
CurveFormula VideoPower(double out_scale, double exponent, double join, double slope) {
  CurveFormula f;
  f.kind = Kind::kPower;
  f.exponent = exponent, f.out_scale = out_scale, f.out_offset = 1 - out_scale;
  f.join = join, f.slope = slope;
  f.negatives = Negatives::kMirror;
  return f;
}

CurveFormula OfKind(Kind kind) {
  CurveFormula f;
  f.kind = kind;
  f.negatives = Negatives::kMirror;
  return f;
}

CurveFormula PlainLog(double scale) {
  CurveFormula f;
  f.kind = Kind::kLog;
  f.out_scale = scale;
  return f;
}

// ARRI LogC4 as its specification builds it.
CurveFormula LogC4() {
  const double a = (std::ldexp(1.0, 18) - 16) / 117.45, b = (1023.0 - 95) / 1023, c = 95.0 / 1023;
  const double lowest = std::exp2(14 * (-c / b) + 6), t = (lowest - 64) / a;
  return CameraLog(b / 14 * kLog2Of10, c - 6 * b / 14, a, 64, t, a * b / (14 * std::log(2.0) * lowest));
}

// The formula that undoes another: light of a signal.
CurveFormula InverseOf(const CurveFormula& f) {
  CurveFormula g = f;
  switch (f.kind) {
    case Kind::kPq:
      g.kind = Kind::kPqInverse;
      return g;
    case Kind::kHlg:
      g.kind = Kind::kHlgInverse;
      return g;
    case Kind::kLog:
      g.kind = Kind::kExp;
      break;
    default:
      g.exponent = 1 / f.exponent;
  }
  g.floor = 0;
  g.in_scale = 1 / f.out_scale, g.in_offset = -f.out_offset / f.out_scale;
  g.out_scale = 1 / f.in_scale, g.out_offset = f.in_offset == 0 ? 0 : -f.in_offset / f.in_scale;
  g.slope = 1 / f.slope, g.offset = f.offset == 0 ? 0 : -f.offset / f.slope;
  g.join = f.slope * f.join + f.offset;
  return g;
}

}  // namespace

CurveFormula Encoding(TransferFunction curve) {
  switch (curve) {
    case TransferFunction::kSrgb:
      return VideoPower(1.055, 1 / 2.4, 0.00313066844250063403, 12.92);
    case TransferFunction::kRec709:
      return VideoPower(1.09929682680944, 0.45, 0.018053968510807, 4.5);
    case TransferFunction::kPq:
      return OfKind(Kind::kPq);
    case TransferFunction::kHlg:
      return OfKind(Kind::kHlg);
    case TransferFunction::kAcesCct: {
      const double scale = kLog2Of10 / 17.52;
      return CameraLog(scale, 9.72 / 17.52, 1, 0, 0.0078125, SlopeAt(scale, 1, 0, 0.0078125));
    }
    case TransferFunction::kCineon: {
      const double black = std::pow(10.0, (95.0 - 685.0) * 0.002 / 0.6);
      CurveFormula f = PlainLog(300.0 / 1023 / kLog2Of10);
      f.in_scale = 1 - black, f.in_offset = black, f.out_offset = 685.0 / 1023, f.floor = kLowestArgument;
      return f;
    }
    case TransferFunction::kLogC3:
      return CameraLog(0.247190, 0.385537, 5.555556, 0.052272, 0.010591, 5.367655);
    case TransferFunction::kLogC4:
      return LogC4();
    case TransferFunction::kSLog3:
      return CameraLog(261.5 / 1023, 420.0 / 1023, 1 / 0.19, 0.01 / 0.19, 0.01125,
                       (171.2102946929 - 95) / 0.01125 / 1023);
    case TransferFunction::kVLog:
      return CameraLog(0.241514, 0.598206, 1, 0.00873, 0.01, 5.6);
    case TransferFunction::kLog3G10:
      return CameraLog(0.224282, 0, 155.975327, 1 + 0.01 * 155.975327, -0.01, 15.1927);
    case TransferFunction::kLog10:
      return PlainLog(1 / kLog2Of10);
    case TransferFunction::kLog2:
      return PlainLog(1);
    case TransferFunction::kLn:
      return PlainLog(0.69314718055994530942);
  }
  throw Error("curve", "found an unknown transfer function, expected one of TransferFunction");
}

CurveFormula Decoding(TransferFunction curve) { return InverseOf(Encoding(curve)); }

const std::vector<std::string>& TransferFunctionNames() {
  static const std::vector<std::string> kNames = {"srgb",  "rec709",  "pq",    "hlg",   "acescct",
                                                  "log10", "cineon",  "logc3", "logc4", "slog3",
                                                  "vlog",  "log3g10", "log2",  "ln"};
  return kNames;
}

}  // namespace tessera
