// Curves by control points, as tables.
#include <algorithm>
#include <cmath>

#include "base/number_text.h"
#include "ops/grade/grade_ops.h"
#include "ops/modifiers.h"
#include "tessera/error.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/lookup.h"

namespace tessera {
namespace ops {
namespace {

constexpr int kEntries = 4097, kMostPoints = 64;

// Fritsch and Carlson 1980: slopes that keep every piece monotone.
std::vector<double> Slopes(const CurvePoints& points) {
  const size_t n = points.size();
  std::vector<double> secant(n - 1), slope(n);
  for (size_t k = 0; k + 1 < n; ++k)
    secant[k] = (points[k + 1][1] - points[k][1]) / (points[k + 1][0] - points[k][0]);
  slope[0] = secant[0], slope[n - 1] = secant[n - 2];
  for (size_t k = 1; k + 1 < n; ++k)
    slope[k] = secant[k - 1] * secant[k] > 0 ? (secant[k - 1] + secant[k]) / 2 : 0;
  for (size_t k = 0; k + 1 < n; ++k) {
    if (secant[k] == 0) {
      slope[k] = slope[k + 1] = 0;
      continue;
    }
    const double a = slope[k] / secant[k], b = slope[k + 1] / secant[k], length = std::hypot(a, b);
    if (length > 3) slope[k] = 3 * a / length * secant[k], slope[k + 1] = 3 * b / length * secant[k];
  }
  return slope;
}

double ValueAt(const CurvePoints& points, const std::vector<double>& slopes, double x) {
  if (x <= points.front()[0]) return points.front()[1];
  if (x >= points.back()[0]) return points.back()[1];
  size_t k = 0;
  while (x > points[k + 1][0]) ++k;
  const double width = points[k + 1][0] - points[k][0], t = (x - points[k][0]) / width, u = 1 - t;
  return u * u * (1 + 2 * t) * points[k][1] + t * u * u * width * slopes[k] +
         t * t * (3 - 2 * t) * points[k + 1][1] - t * t * u * width * slopes[k + 1];
}

void RequirePoints(const CurvePoints& points) {
  if (points.size() < 2) throw Error("curves", "found one point, expected at least two");
  for (size_t k = 0; k < points.size(); ++k) {
    const double x = points[k][0];
    if (x >= 0 && x <= 1 && (k == 0 || x > points[k - 1][0]) && std::fabs(points[k][1]) <= 1e30) continue;
    throw Error("curves", "found a point at " + base::NumberText(x) +
                              (k > 0 ? " behind one at " + base::NumberText(points[k - 1][0]) : "") +
                              ", expected places that rise from 0 to 1");
  }
}

Table TableOf(const CurvePoints& points) {
  RequirePoints(points);
  const std::vector<double> slopes = Slopes(points);
  std::vector<float> samples;
  for (int i = 0; i < kEntries; ++i)
    samples.push_back(static_cast<float>(ValueAt(points, slopes, static_cast<double>(i) / (kEntries - 1))));
  return Table({kEntries}, 1, samples, TableAlign::kEnds);
}

CurvePoints PointsOf(const std::vector<double>& numbers) {
  CurvePoints points;
  for (size_t k = 0; k + 1 < numbers.size(); k += 2) points.push_back({numbers[k], numbers[k + 1]});
  return points;
}

ParamInfo Points(const char* name, const char* help) {
  ParamInfo p = ListModifier(name, "", 2 * kMostPoints, -1e30, 1e30, help);
  for (int n = 2; n <= kMostPoints; ++n) p.counts.push_back(2 * n);
  return p;
}

}  // namespace

OpInfo CurvesInfo() {
  OpInfo info = MadeRow(
      "grade", "curves", "Curves through control points",
      "POINTS are x,y,x,y,... with x rising from 0 to 1: R,G,B go through a curve of monotone cubic pieces through them, "
      "which overshoots nowhere and is level beyond the first and the last point. red=, green= and blue= are curves of "
      "one channel in place of the common one. The curve is tabulated at 4,097 places with straight lines between; "
      "samples are limited to [0,1] first, NaN is 0. Alpha and further channels are kept. Source: Fritsch and Carlson "
      "1980.");
  info.arguments = {Points("POINTS", "x,y of two points or more, for R, G and B")};
  info.modifiers = {Points("red", "x,y of points, for R"), Points("green", "x,y of points, for G"),
                    Points("blue", "x,y of points, for B")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Curves(in[0], {.all = PointsOf(a.Numbers("POINTS")),
                          .red = PointsOf(a.Numbers("red")),
                          .green = PointsOf(a.Numbers("green")),
                          .blue = PointsOf(a.Numbers("blue"))});
  };
  info.examples = {"0,0,0.25,0.18,0.75,0.85,1,1", "0,0,1,1 blue=0,0.1,1,0.9",
                   "0.1,0,0.5,0.6,0.9,1 red=0,0,0.4,0.5,1,1"};
  return info;
}

}  // namespace ops

double CurveThrough(const CurvePoints& points, double x) {
  ops::RequirePoints(points);
  return ops::ValueAt(points, ops::Slopes(points), x);
}

Node Curves(const Node& image, const CurvesParams& p) {
  const Table all = p.all.empty() ? Table() : ops::TableOf(p.all);
  Tables1DParams tables;
  for (const CurvePoints* own : {&p.red, &p.green, &p.blue})
    tables.tables.push_back(own->empty() ? all : ops::TableOf(*own));
  return AsColors(image, [&](const Node& colors) { return ApplyTables1D(colors, tables); });
}

}  // namespace tessera
