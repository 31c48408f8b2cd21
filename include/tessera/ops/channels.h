/// Selecting, appending and naming channels; cropping. No arithmetic: samples keep their bits. @file
#ifndef TESSERA_OPS_CHANNELS_H_
#define TESSERA_OPS_CHANNELS_H_

#include <functional>
#include <string>
#include <vector>

#include "tessera/export.h"
#include "tessera/node.h"
#include "tessera/roi.h"

TESSERA_API_BEGIN
namespace tessera {

/// One channel of a selection: a channel of the image, or a constant where `channel` is -1.
struct ChannelChoice {
  int channel = 0;   ///< from 0; -1: the constant
  float value = 0;   ///< the constant
  std::string name;  ///< of the result; empty keeps the channel's name, or the default name of the position
};

/// The chosen channels in that order; a channel may be chosen several times. The result's alpha is the first
/// channel named A or alpha, or else the first unrenamed copy of the image's alpha. Error when the list is
/// empty or an index is outside the image.
Node SelectChannels(const Node& image, const std::vector<ChannelChoice>& choices);

/// The same from text, as oiiotool's --ch: comma-separated entries CHANNEL, NAME=CHANNEL, NAME=VALUE or
/// =VALUE, where CHANNEL is a name (exact, or else regardless of case) or an index from 0. Error lists the
/// channels present when one is missing.
Node SelectChannels(const Node& image, const std::string& list);

/// All channels of a, then all of b, over both data windows; 0 where one has no pixel. A name that is taken
/// becomes channelN, N its position. Alpha is a's, or else b's.
Node AppendChannels(const Node& a, const Node& b);

/// Renames channels in order; an empty name, or one that the list does not reach, stays; names beyond the
/// last channel are ignored, as oiiotool. Alpha is then the channel named A or alpha, or else stays where it
/// was.
Node RenameChannels(const Node& image, const std::vector<std::string>& names);

/// `transform`, which takes R,G,B at least, on an image of any channels. With three or more it is called as
/// it is. One channel beside alpha is a grey, in R, G and B alike, of which the result's R is kept; two are R
/// and G of a colour without blue, as in oiiotool; alpha goes along; alpha alone is returned as it is.
Node AsColors(const Node& image, const std::function<Node(const Node&)>& transform);

/// Weights of ChannelSum: one serves every channel, alpha included; of several the n-th is channel n's, and
/// channels beyond the list have weight 1. A channel of weight 0 takes no part. Finite, else Error.
struct ChannelSumParams {
  std::vector<double> weights = {1};  ///< in channel order
};
/// One channel, Y: the weighted sum of all channels.
Node ChannelSum(const Node& image, const ChannelSumParams& params = {});
/// One channel, Y: the largest sample of each pixel, all channels compared; a number wins over NaN.
Node MaxChannel(const Node& image);
/// The smallest sample, likewise.
Node MinChannel(const Node& image);
/// The image's mean: one pixel with the image's channels, float. Pixels with a sample that is not finite, in
/// whatever channel, do not count; NaN where none is left. Rows are added in double, from the top to the
/// bottom and with what is lost in rounding kept, whatever the threads and tiles; one pass over the image,
/// which is not held in memory. |error| <= u |mean| + 2^-44 of the mean magnitude.
Node Mean(const Node& image);

/// The data window becomes `window`; the display window stays. Pixels that the image does not have are zero.
Node Crop(const Node& image, const Roi& window);

/// A geometry WxH, WxH+X+Y, +X+Y or x0,y0,x1,y1 (x1 and y1 included), as oiiotool's --crop; what is not named
/// is taken from `base`. Error when it is none of these, holds no pixel, or leaves the range of int.
Roi ParseGeometry(const std::string& text, const Roi& base);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_CHANNELS_H_
