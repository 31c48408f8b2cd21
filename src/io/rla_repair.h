// What OpenImageIO's RLA writer gets wrong in the last column.
#ifndef TESSERA_IO_RLA_REPAIR_H_
#define TESSERA_IO_RLA_REPAIR_H_

#include <cstddef>
#include <span>
#include <string>

namespace tessera::io {

// The last sample of a row that is a run of its own is written as the one before it (OpenImageIO 2.4.7). Puts
// the right ones in their places in a finished file of one image of `rows` x `width` pixels of `channels`
// integers of `bytes` bytes, in this machine's order in `last_column`, from the top. False for a file that is
// not as that writer leaves it, or that cannot be changed.
bool RepairRla(const std::string& file, int width, int rows, int channels, size_t bytes,
               std::span<const std::byte> last_column);

}  // namespace tessera::io

#endif  // TESSERA_IO_RLA_REPAIR_H_
