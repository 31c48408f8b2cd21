// Registry rows of the channels family: channel selection, names, windows.
#ifndef TESSERA_OPS_CHANNELS_CHANNELS_OPS_H_
#define TESSERA_OPS_CHANNELS_CHANNELS_OPS_H_

#include "ops/registry.h"

namespace tessera::ops {

OpInfo SelectChannelsInfo();
OpInfo AppendChannelsInfo();
OpInfo RenameChannelsInfo();
OpInfo CropInfo();
OpInfo CutInfo();
OpInfo ChannelSumInfo();
OpInfo MaxChannelInfo();
OpInfo MinChannelInfo();
OpInfo MeanInfo();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_CHANNELS_CHANNELS_OPS_H_
