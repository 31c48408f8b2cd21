// Tables of volume pictures: transfer functions, ramps, and the chains of the presets.
#ifndef TESSERA_OPS_VOLUME_TRANSFER_H_
#define TESSERA_OPS_VOLUME_TRANSFER_H_

#include <vector>

#include "ops/volume/prepare.h"

namespace tessera::ops::volume {

// Fills the colours of a solid texture and their domain: the caller's, or those of polished stone.
void MakeColors(VolumeDraw& draw);
// Fills transfer, its domain and, where asked for, the pre-integrated pairs.
void MakeTransfer(VolumeDraw& draw);
// The values between which something is seen; false where nothing ever is.
bool TransferSupport(const VolumeDraw& draw, double& from, double& to);

// Fire's chain: flames rise from the surface. `side`: the volume's longest side.
std::vector<Dmf> FireChain(const VolumeParams& params, double side);
// Checks a step and makes the noise it needs.
void CompleteDmf(Dmf& step);
// Largest |turbulence| that a step can read.
double TurbulenceRange(const Dmf& step);
// The density before the chain up to which nothing is seen behind it.
double Unseen(const std::vector<Dmf>& chain, const MediumArgs& m);
// The octaves of turbulence that is read exactly.
void ExactOctaves(ExactOctave (&octaves)[kTurbulenceOctaves]);

}  // namespace tessera::ops::volume

#endif  // TESSERA_OPS_VOLUME_TRANSFER_H_
