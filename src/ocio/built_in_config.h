// The config that is used where neither a file nor the variable OCIO names one.
#ifndef TESSERA_OCIO_BUILT_IN_CONFIG_H_
#define TESSERA_OCIO_BUILT_IN_CONFIG_H_

namespace tessera::ocio {

// In OpenColorIO's format, version 2.
const char* BuiltInConfigText();

}  // namespace tessera::ocio

#endif  // TESSERA_OCIO_BUILT_IN_CONFIG_H_
