// OpenColorIO as a peer, once for each version that is built in: the one that the system ships, which the
// library itself is built on, and the newest one that bench/newest has built.
#ifndef TESSERA_BENCH_PEERS_OCIO_PEER_H_
#define TESSERA_BENCH_PEERS_OCIO_PEER_H_

#include <memory>
#include <string>
#include <vector>

#include "contestant.h"
#include "lookup_peers.h"
#include "tessera/table.h"

namespace tessera::bench {

// The same sources, compiled against the headers of one version and linked with it; their namespace holds the
// version, so that both live in one process.
#define TESSERA_BENCH_DECLARE_OCIO(room)                                                                     \
  namespace room {                                                                                           \
  std::string Version();                                                                                     \
  std::unique_ptr<Contestant> MakeChain(const Setting& setting, const std::string& name);                    \
  PeerCall Cube(const Table& table, bool tetrahedral, const Image& input, const Image& output, int threads); \
  PeerCall Curve(const Table& table, const Image& input, const Image& output, int threads);                  \
  }

TESSERA_BENCH_DECLARE_OCIO(shipped_ocio)
TESSERA_BENCH_DECLARE_OCIO(newest_ocio)  // defined under TESSERA_BENCH_NEWEST_OCIO alone

#undef TESSERA_BENCH_DECLARE_OCIO

// Those that are built in, the newest first.
struct OcioVersion {
  std::string name;  // "OpenColorIO 2.1.2"
  decltype(&shipped_ocio::MakeChain) chain;
  decltype(&shipped_ocio::Cube) cube;
  decltype(&shipped_ocio::Curve) curve;
};
const std::vector<OcioVersion>& OcioVersions();

}  // namespace tessera::bench

#endif  // TESSERA_BENCH_PEERS_OCIO_PEER_H_
