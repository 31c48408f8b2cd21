/// OpenColorIO's own processors as nodes. Not part of tessera.h, as it needs OpenColorIO's header. @file
#ifndef TESSERA_OCIO_ADAPTER_H_
#define TESSERA_OCIO_ADAPTER_H_

#include <OpenColorIO/OpenColorIO.h>

#include "tessera/export.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera {

/// Any processor of the caller's, as the functions of ocio.h apply a config's.
Node ApplyProcessor(const Node& image, const OCIO_NAMESPACE::ConstProcessorRcPtr& processor);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OCIO_ADAPTER_H_
