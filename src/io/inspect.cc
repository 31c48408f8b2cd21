// Statistics and comparison of images in oiiotool's words, computed by OpenImageIO.
#include <OpenImageIO/imagebufalgo.h>

#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <string>
#include <vector>

#include "io/spec.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/io.h"
#include "tessera/oiio_adapter.h"

namespace tessera {
namespace {

__attribute__((format(printf, 1, 2))) std::string Format(const char* format, ...) {
  char text[256];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  return text;
}

// The largest code of an integer image, 0 for floating point. Files of 10 or 12 bits keep that in the
// metadata.
unsigned LargestCode(const ImageSpec& spec) {
  const OIIO::ImageSpec theirs = io::SpecTo(spec, spec.type);
  const unsigned bits = static_cast<unsigned>(theirs.get_int_attribute("oiio:BitsPerSample", 0));
  if (spec.type == PixelType::kUint8) return bits > 0 && bits < 8 ? (1u << bits) - 1 : 255;
  if (spec.type == PixelType::kUint16) return bits > 0 && bits < 16 ? (1u << bits) - 1 : 65535;
  return 0;
}

template <typename T>
std::string Line(const char* title, const std::vector<T>& values, unsigned largest, bool whole) {
  std::string line = std::string("    ") + title + ": ";
  for (const T value : values) {
    const double v = static_cast<double>(static_cast<float>(value) * static_cast<float>(largest));
    if (largest == 0) {
      line += Format("%f ", static_cast<double>(value));
    } else if (whole && std::isfinite(v)) {
      line += Format("%.0f ", std::round(v));
    } else {
      line += Format("%.2f ", v);
    }
  }
  return line + (largest == 0 ? "(float)\n" : Format("(of %u)\n", largest));
}

std::string Counts(const char* title, const std::vector<OIIO::imagesize_t>& counts) {
  std::string line = std::string("    ") + title + ": ";
  for (const auto n : counts) line += std::to_string(n) + " ";
  return line + "\n";
}

std::string Values(const OIIO::ImageBuf& image, int x, int y) {
  std::string list;
  for (int c = 0; c < image.nchannels(); ++c) {
    list += Format("%s%g", c ? ", " : "", static_cast<double>(image.getchannel(x, y, 0, c)));
  }
  return list;
}

std::string Statistics(const Image& image, unsigned largest) {
  const auto buffer = ToImageBuf(image);
  const auto stats = OIIO::ImageBufAlgo::computePixelStats(*buffer);
  if (stats.min.empty()) throw DataError("stats", io::OneLine(buffer->geterror()));
  std::string text =
      Line("Stats Min", stats.min, largest, true) + Line("Stats Max", stats.max, largest, true) +
      Line("Stats Avg", stats.avg, largest, false) + Line("Stats StdDev", stats.stddev, largest, false) +
      Counts("Stats NanCount", stats.nancount) + Counts("Stats InfCount", stats.infcount) +
      Counts("Stats FiniteCount", stats.finitecount);
  std::vector<float> color(static_cast<size_t>(buffer->nchannels()));
  if (OIIO::ImageBufAlgo::isConstantColor(*buffer, 0.0f, color)) {
    text += "    Constant: Yes\n" + Line("Constant Color", color, largest, false);
  } else {
    text += "    Constant: No\n";
  }
  return text + "    Monochrome: " + (OIIO::ImageBufAlgo::isMonochrome(*buffer) ? "Yes\n" : "No\n");
}

}  // namespace

std::string StatsText(const Image& image) { return Statistics(image, LargestCode(image.spec())); }

std::string StatsText(const Node& node, const RenderOptions& options) {
  return Statistics(Render(node, PixelType::kFloat, options), LargestCode(node.spec()));
}

DiffReport Compare(const Image& a, const Image& b, const DiffOptions& options) {
  const auto first = ToImageBuf(a), second = ToImageBuf(b);
  const auto found = OIIO::ImageBufAlgo::compare(*first, *second, static_cast<float>(options.fail),
                                                 static_cast<float>(options.warn));
  if (found.error && first->has_error()) throw DataError("diff", io::OneLine(first->geterror()));
  DiffReport report;
  report.mean_error = found.meanerror;
  report.rms_error = found.rms_error;
  report.psnr = found.PSNR;
  report.max_error = found.maxerror;
  report.max_x = found.maxx;
  report.max_y = found.maxy;
  report.max_channel = found.maxc;
  report.warned = static_cast<int64_t>(found.nwarn);
  report.failed = static_cast<int64_t>(found.nfail);
  const double pixels = static_cast<double>(a.spec().data_window.pixels());
  const auto over = [&](int64_t count, double percent, double hard) {
    return static_cast<double>(count) > percent / 100 * pixels || found.maxerror > hard;
  };
  if (over(report.failed, options.fail_percent, options.hard_fail)) {
    report.verdict = DiffVerdict::kFailure;
  } else if (over(report.warned, options.warn_percent, options.hard_warn)) {
    report.verdict = DiffVerdict::kWarning;
  }
  if (report.verdict != DiffVerdict::kPass) {
    report.text = Format("  Mean error = %g\n  RMS error = %g\n  Peak SNR = %g\n  Max error  = %g",
                         report.mean_error, report.rms_error, report.psnr, report.max_error);
    if (report.max_error != 0) {
      const auto& names = a.spec().channels;
      const std::string channel = found.maxc < static_cast<int>(names.size())
                                      ? names[static_cast<size_t>(found.maxc)]
                                      : "channel " + std::to_string(found.maxc);
      report.text += " @ (" + std::to_string(found.maxx) + ", " + std::to_string(found.maxy) + ", " +
                     channel + ")  values are " + Values(*first, found.maxx, found.maxy) + " vs " +
                     Values(*second, found.maxx, found.maxy);
    }
    const auto share = [&](int64_t count, double threshold) {
      return "\n  " + std::to_string(count) +
             Format(" pixels (%.3g%%) over %g", 100.0 * static_cast<double>(count) / pixels, threshold);
    };
    report.text += share(report.warned, options.warn) + share(report.failed, options.fail) + "\n";
  }
  constexpr const char* kVerdicts[] = {"PASS", "WARNING", "FAILURE"};
  report.text += std::string(kVerdicts[static_cast<int>(report.verdict)]) + "\n";
  return report;
}

}  // namespace tessera
