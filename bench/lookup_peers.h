// Peers of the lookups: each returns a call that reads `input` and writes `output`; one that is not built in
// throws when it is called. OpenColorIO is in peers/ocio_peer.h.
#ifndef TESSERA_BENCH_LOOKUP_PEERS_H_
#define TESSERA_BENCH_LOOKUP_PEERS_H_

#include <functional>
#include <vector>

#include "tessera/image.h"
#include "tessera/table.h"

namespace tessera::bench {

using PeerCall = std::function<void()>;

// cv::LUT with one table for all channels or one for each, from the same float tables.
PeerCall OpenCvCodes(const std::vector<Table>& tables, bool one, const Image& input, const Image& output,
                     int threads);
// cv::remap, its maps made beforehand from the coordinates.
PeerCall OpenCvRemap(const Image& texture, bool cubic, const Image& coords, const Image& output, int threads);
// Little CMS: a device link that holds the 4-D table, float CMYK to float RGB.
PeerCall LcmsInks(const Table& table, const Image& input, const Image& output, int threads);

}  // namespace tessera::bench

#endif  // TESSERA_BENCH_LOOKUP_PEERS_H_
