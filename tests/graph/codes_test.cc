// Affine operations on codes: factors and constants of every size, against the same in floats.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "ops/registry.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using T = PixelType;

// Every code of 8 bits, or as many of 16, as pixels whose channels differ.
Image Codes(T type, int channels) {
  ImageSpec spec(256, 4, channels, type);
  const Image image(spec);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 256; ++x) {
      for (int c = 0; c < channels; ++c) {
        const int code = (x + 64 * c * y + 3 * y) % 256;
        if (type == T::kUint8) {
          image.at<uint8_t>(x, y, c) = static_cast<uint8_t>(code);
        } else {
          image.at<uint16_t>(x, y, c) = static_cast<uint16_t>(code * 257 - (code > 0 ? y : 0));
        }
      }
    }
  }
  return image;
}

int CodeAt(const Image& image, int x, int y, int c) {
  return image.spec().type == T::kUint8 ? image.at<uint8_t>(x, y, c) : image.at<uint16_t>(x, y, c);
}

// On codes what the floats' result rounds to; its neighbour where that lies as near to the tie as constants
// that are no floats, and sums, may be off. `terms`: how large a sum's terms are together where it is at
// most 1.
void ExpectCodesOfFloats(const std::string& op, const std::string& arguments, T type, int channels,
                         double terms = 2) {
  const ops::OpInfo* const info = ops::FindOp(op);
  ASSERT_NE(info, nullptr) << op;
  const Node source = FromImage(Codes(type, channels));
  const Node node = info->make(std::vector{source}, ops::ParseExample(*info, arguments), nullptr);
  const Image on = Render(node, type), floats = Render(node, T::kFloat, {.rules_off = {"all"}});
  const double steps = type == T::kUint8 ? 255 : 65535;
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 256; ++x) {
      for (int c = 0; c < channels; ++c) {
        const double exact = std::fmin(std::fmax(floats.at<float>(x, y, c), 0.0), 1.0) * steps;
        const double off = std::fabs(CodeAt(on, x, y, c) - exact);
        ASSERT_LE(off, 0.5 + 0x1p-12 + 4 * 0x1p-24 * terms * steps)
            << op << " " << arguments << " of " << channels << " channels of " << PixelTypeName(type)
            << " at " << x << "," << y << "," << c;
      }
    }
  }
}

TEST(Codes, FactorsOfAnySize) {
  for (const std::string& target : SimdTargets()) {
    SetSimdTarget(target);
    SCOPED_TRACE(target);
    for (const T type : {T::kUint8, T::kUint16}) {
      for (const int channels : {3, 4}) {
        for (const char* const factor :
             {"0",     "0.001", "0.5",  "1",    "1.7",  "3",    "40",   "100",  "127",
              "129",   "140",   "200",  "250",  "256",  "257",  "300",  "1000", "65535",
              "65536", "1e6",   "1e30", "-0.5", "-100", "-129", "-250", "-1e6"}) {
          ExpectCodesOfFloats("mulc", factor, type, channels);
          const std::string each = std::string(factor) + ",1,0.5,1";
          ExpectCodesOfFloats("mulc", each, type, channels);
        }
        for (const char* const constant :
             {"0.25", "-0.25", "0.5", "1", "-1", "0.99", "100", "128", "-128", "129", "257", "1e4", "-1e6"}) {
          ExpectCodesOfFloats("addc", constant, type, channels);
          ExpectCodesOfFloats("subc", std::string("0.1,") + constant, type, channels);
        }
        for (const char* const limits :
             {"min=0.2 max=0.7", "min=-5 max=0.5", "min=0.25", "max=300", "min=0.1,0.2 max=0.9"})
          ExpectCodesOfFloats("clamp", limits, type, channels);
        ExpectCodesOfFloats("invert", "", type, channels);
        ExpectCodesOfFloats("contrast", "130", type, channels, 260);
        for (const char* const matrix :
             {"90,40,0,0,1,0,0,0,1", "60,60,60,-60,60,0,-100,-20,-10", "1,0,0,0.2,0.7,0.1,-129,0,0"})
          ExpectCodesOfFloats("ccmatrix", matrix, type, channels, 200);
        ExpectCodesOfFloats("saturate", "150", type, channels, 300);
      }
    }
  }
  SetSimdTarget("auto");
}

}  // namespace
}  // namespace tessera
