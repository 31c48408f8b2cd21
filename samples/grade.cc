// Grades a photograph: the example of the README.   grade IN OUT
#include <cstdio>

#include "tessera/tessera.h"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: grade IN OUT\n");
    return 2;
  }
  const char *in = argv[1], *out = argv[2];
  try {
    tessera::Node photo = tessera::Read(in);
    tessera::Node warm = tessera::MulConstant(photo, {1.12, 1.05, 0.95, 1});
    tessera::Node graded = tessera::RotateHue(tessera::Saturate(warm, 1.35), tessera::Degrees(150));
    tessera::Write(graded, out, {.type = tessera::PixelType::kUint8});
    std::puts(tessera::Verify(graded).Summary().c_str());
  } catch (const tessera::Error& error) {
    std::fprintf(stderr, "grade: %s\n", error.what());
    return 1;
  }
  return 0;
}
