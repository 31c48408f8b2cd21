// --region and --join: a picture in pieces, made by several processes and put together.
#ifndef TESSERA_CLI_PIECES_H_
#define TESSERA_CLI_PIECES_H_

#include <string>
#include <vector>

#include "cli/session.h"
#include "tessera/roi.h"

namespace tessera::cli {

// X,Y,W,H. Throws UsageError.
Roi ParseRegion(const std::string& text);

// Leaves of an output what lies in the region that was asked for. Throws DataError where that is nothing, and
// for formats that cannot say where in the picture it is.
void KeepRegion(Entry& entry, const std::string& file, const Options& options);

// Whether every pixel of `all` is in one of the windows at least. Otherwise `gap` is a rectangle that is in
// none.
bool Covers(const std::vector<Roi>& windows, const Roi& all, Roi& gap);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_PIECES_H_
