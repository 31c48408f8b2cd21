// The size of the block of pixels that a point kernel sees: short enough that a chain of stages stays in L1.
#ifndef TESSERA_BASE_BLOCK_H_
#define TESSERA_BASE_BLOCK_H_

namespace tessera {

// 256 pixels x 4 planes x 4 bytes = 4 KB; long planar rows leave L1 and cost up to 2.7 times as much.
inline constexpr int kBlockPixels = 256;
// The widest vector of any compiled target, in floats: blocks are padded to whole groups.
inline constexpr int kGroupPixels = 16;
static_assert(kBlockPixels % kGroupPixels == 0);

}  // namespace tessera

#endif  // TESSERA_BASE_BLOCK_H_
