// Shared readings of operation arguments, and the list of peers.
#include "peers/peers.h"

#include <OpenImageIO/oiioversion.h>
#if defined(TESSERA_BENCH_OPENCV)
#include <opencv2/core/version.hpp>
#endif

#if defined(TESSERA_BENCH_PIXMAN)
#include <pixman.h>
#endif

#include "contestant.h"
#include "peers/ocio_peer.h"

namespace tessera::bench {

std::optional<std::pair<std::vector<double>, std::vector<double>>> ClampRange(const Step& step) {
  std::vector<double> lo = step.Numbers("min"), hi = step.Numbers("max");
  for (std::vector<double>* v : {&lo, &hi}) {
    if (v->size() == 1) v->assign(4, v->front());
    if (v->size() != 4) return std::nullopt;
  }
  return std::make_pair(lo, hi);
}

bool IsRec709(const Step& step) {
  const auto found = step.arguments.values.find("weights");
  return found != step.arguments.values.end() && found->second.text == "rec709";
}

const std::vector<OcioVersion>& OcioVersions() {
  static const std::vector<OcioVersion> versions = {
#if defined(TESSERA_BENCH_NEWEST_OCIO)
    {"OpenColorIO " + newest_ocio::Version(), newest_ocio::MakeChain, newest_ocio::Cube, newest_ocio::Curve},
#endif
    {"OpenColorIO " + shipped_ocio::Version(), shipped_ocio::MakeChain, shipped_ocio::Cube,
     shipped_ocio::Curve}
  };
  return versions;
}

std::unique_ptr<Contestant> MakeOcio(const Setting& setting) {
  const OcioVersion& shipped = OcioVersions().back();
  return shipped.chain(setting, shipped.name);
}

std::unique_ptr<Contestant> MakeNewestOcio(const Setting& setting) {
  const OcioVersion& newest = OcioVersions().front();
  return OcioVersions().size() > 1 ? newest.chain(setting, newest.name) : nullptr;
}

std::vector<std::pair<std::string, std::string>> PeerVersions() {
  std::vector<std::pair<std::string, std::string>> versions = {{"OpenImageIO", OIIO_VERSION_STRING},
                                                               {"OpenColorIO", shipped_ocio::Version()}};
#if defined(TESSERA_BENCH_NEWEST_OCIO)
  versions.back().second = newest_ocio::Version() + " and " + versions.back().second;
#endif
#if defined(TESSERA_BENCH_PIXMAN)
  versions.emplace_back("pixman", pixman_version_string());
#endif
#if defined(TESSERA_BENCH_OPENCV)
  versions.emplace_back("OpenCV", CV_VERSION);
#endif
  return versions;
}

}  // namespace tessera::bench
