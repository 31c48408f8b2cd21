// Cameras from numbers and from files' metadata: matrices of any kind are refused or give rays.
#include "fuzz/fuzz.h"
#include "tessera/camera.h"

using namespace tessera;

namespace {

std::string Bytes(const auto& values) {
  return {reinterpret_cast<const char*>(values.data()), sizeof(values[0]) * values.size()};
}

}  // namespace

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  const Camera view = Camera::Perspective({1, 2, 5}, {0, 0, 0}, {0, 1, 0}, 40, 1.5, 0.1, 100),
               flat = Camera::Parallel({1, 2, 5}, {0, 0, 0}, {0, 1, 0}, 4, 1.5, 0.1, 100);
  std::vector<std::string> seeds;
  for (const Camera& camera : {view, flat}) {
    const std::string both = Bytes(camera.world_to_camera()) + Bytes(camera.world_to_clip());
    seeds.push_back('n' + both), seeds.push_back('o' + Bytes(camera.world_to_clip()));
    seeds.push_back(std::string("mworldToCamera\nworldtoscreen\nmatrix\n") + both);
  }
  return seeds;
}
std::vector<std::string> Words() {
  return {"worldToCamera",
          "worldToNDC",
          "worldtoscreen",
          "worldtocamera",
          "float[16]",
          "matrix",
          "double[16]",
          Bytes(std::array{1.0}),
          Bytes(std::array{-1.0}),
          Bytes(std::array{1e300}),
          Bytes(std::array{1e-300}),
          Bytes(std::array{0.0}),
          Bytes(std::array{1.0f}),
          std::string("\0\0\0\0\0\0\xf8\x7f", 8)};
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  fuzz::Input in(data, size);
  const char kind = in.Take<char>();
  fuzz::Try([&] {
    std::optional<Camera> camera;
    if (kind == 'm') {
      ImageSpec spec(8, 6, 3);
      std::vector<Attribute> attributes;
      const std::string names[] = {std::string(in.Until('\n')), std::string(in.Until('\n'))},
                        type(in.Until('\n'));
      const std::string_view bytes = in.Rest();
      for (size_t i = 0; i < 2; ++i) {
        const std::string_view part =
            i == 0 ? bytes.substr(0, bytes.size() / 2) : bytes.substr(bytes.size() / 2);
        const auto* const first = reinterpret_cast<const std::byte*>(part.data());
        attributes.push_back({names[i], type, {first, first + part.size()}, {}});
      }
      spec.metadata = std::make_shared<const std::vector<Attribute>>(std::move(attributes));
      camera = Camera::FromMetadata(spec);
      if (camera) camera->ToMetadata(spec);
    } else {
      std::vector<double> numbers(kind == 'n' ? 32 : 16);
      for (double& v : numbers) v = in.Take<double>();
      camera = Camera::FromNumbers(numbers);
    }
    if (!camera) return;
    const Camera::Ray ray = camera->RayAt(0.3, -0.2);
    camera->PlanarDepth(ray.origin);
    camera->PointAt(0.5, 0.5, 2);
    camera->PixelRay({0, 0, 8, 6}, 3, 2);
  });
  return 0;
}
