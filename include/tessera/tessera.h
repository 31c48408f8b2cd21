// Everything of the library in one include.
#ifndef TESSERA_TESSERA_H_
#define TESSERA_TESSERA_H_

#include "tessera/error.h"
#include "tessera/image.h"
#include "tessera/io.h"
#include "tessera/node.h"
#include "tessera/ocio.h"
#include "tessera/ops/accumulate.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/color.h"
#include "tessera/ops/curve.h"
#include "tessera/ops/filter.h"
#include "tessera/ops/flow.h"
#include "tessera/ops/generate.h"
#include "tessera/ops/geometry.h"
#include "tessera/ops/lookup.h"
#include "tessera/ops/noise.h"
#include "tessera/ops/texture.h"
#include "tessera/ops/transfer.h"
#include "tessera/render.h"
#include "tessera/roi.h"
#include "tessera/table.h"
#include "tessera/targets.h"
#include "tessera/verify.h"

#endif  // TESSERA_TESSERA_H_
