// Peers of the lookups: each returns a call that reads `input` and writes `output`, or nothing where it is
// not built in.
#ifndef TESSERA_BENCH_LOOKUP_PEERS_H_
#define TESSERA_BENCH_LOOKUP_PEERS_H_

#include <functional>
#include <vector>

#include "tessera/image.h"
#include "tessera/table.h"

namespace tessera::bench {

using PeerCall = std::function<void()>;

// OpenColorIO's optimised CPU processor with one 3-D or 1-D transform, alpha passed on.
PeerCall OcioCube(const Table& table, bool tetrahedral, const Image& input, const Image& output);
PeerCall OcioCurve(const Table& table, const Image& input, const Image& output);
// cv::LUT with one table for all channels or one for each, from the same float tables.
PeerCall OpenCvCodes(const std::vector<Table>& tables, bool one, const Image& input, const Image& output);
// cv::remap, its maps made beforehand from the coordinates.
PeerCall OpenCvRemap(const Image& texture, bool cubic, const Image& coords, const Image& output);
// Little CMS: a device link that holds the 4-D table, float CMYK to float RGB.
PeerCall LcmsInks(const Table& table, const Image& input, const Image& output);

}  // namespace tessera::bench

#endif  // TESSERA_BENCH_LOOKUP_PEERS_H_
