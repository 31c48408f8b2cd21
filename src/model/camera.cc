// Cameras: projection matrices taken apart into rays, and put together from directions and angles.
#include "tessera/camera.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "base/number_text.h"
#include "tessera/error.h"

namespace tessera {
namespace {

Vector3 Row(const Matrix4& m, int row) { return {m[row * 4], m[row * 4 + 1], m[row * 4 + 2]}; }
Vector3 Plus(const Vector3& a, const Vector3& b, double t) {
  return {a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]};
}
Vector3 Times(const Vector3& a, double t) { return {a[0] * t, a[1] * t, a[2] * t}; }
double Length(const Vector3& v) { return std::hypot(v[0], v[1], v[2]); }

void RequireFinite(const Matrix4& m, const std::string& subject) {
  if (!std::all_of(m.begin(), m.end(), [](double v) { return std::isfinite(v); })) {
    throw Error(subject, "found a number that is not finite, expected 16 finite numbers");
  }
}

// The rotation and translation of a camera at `eye` that looks down its -z.
Matrix4 LookAt(const Vector3& eye, const Vector3& target, const Vector3& up) {
  const Vector3 back = Normalized(Plus(eye, target, -1));
  const Vector3 right = Normalized(Cross(up, back));
  if (Length(back) == 0 || Length(right) == 0) {
    throw Error("camera",
                "found an eye at its target or an up vector along the view, expected two directions");
  }
  const Vector3 over = Cross(back, right);
  return {right[0], right[1], right[2], -Dot(right, eye), over[0], over[1], over[2], -Dot(over, eye),
          back[0],  back[1],  back[2],  -Dot(back, eye),  0,       0,       0,       1};
}

void RequireRange(double near, double far, double aspect) {
  if (!(near < far) || !(aspect > 0) || !std::isfinite(far) || !std::isfinite(aspect)) {
    throw Error("camera", "found near " + base::NumberText(near) + ", far " + base::NumberText(far) +
                              ", aspect " + base::NumberText(aspect) +
                              ", expected near < far and a positive aspect");
  }
}

const Attribute* FindMatrix(const ImageSpec& spec, std::initializer_list<const char*> names) {
  if (!spec.metadata) return nullptr;
  const auto same = [](const std::string& a, const char* b) {
    return a.size() == std::strlen(b) && std::equal(a.begin(), a.end(), b, [](char x, char y) {
             return std::tolower(static_cast<unsigned char>(x)) ==
                    std::tolower(static_cast<unsigned char>(y));
           });
  };
  for (const char* name : names) {
    for (const Attribute& a : *spec.metadata) {
      if (same(a.name, name) && a.bytes.size() == 16 * sizeof(float)) return &a;
    }
  }
  return nullptr;
}
constexpr std::initializer_list<const char*> kCameraNames = {"worldToCamera", "exr/worldToCamera"};
// OpenImageIO calls OpenEXR's worldToNDC worldtoscreen.
constexpr std::initializer_list<const char*> kClipNames = {"worldtoscreen", "worldToNDC", "exr/worldToNDC"};

Matrix4 FromAttribute(const Attribute& a) {
  float values[16];
  std::memcpy(values, a.bytes.data(), sizeof values);
  Matrix4 m;
  std::copy(values, values + 16, m.begin());
  return Transposed(m);
}

Attribute ToAttribute(const char* name, const Matrix4& m) {
  const Matrix4 t = Transposed(m);
  float values[16];
  for (int i = 0; i < 16; ++i) values[i] = static_cast<float>(t[static_cast<size_t>(i)]);
  Attribute a{name, "matrix", std::vector<std::byte>(sizeof values), {}};
  std::memcpy(a.bytes.data(), values, sizeof values);
  return a;
}

}  // namespace

Matrix4 Product(const Matrix4& a, const Matrix4& b) {
  Matrix4 m{};
  for (size_t i = 0; i < 4; ++i) {
    for (size_t j = 0; j < 4; ++j) {
      for (size_t k = 0; k < 4; ++k) m[i * 4 + j] += a[i * 4 + k] * b[k * 4 + j];
    }
  }
  return m;
}

Matrix4 Transposed(const Matrix4& m) {
  Matrix4 t;
  for (size_t i = 0; i < 4; ++i) {
    for (size_t j = 0; j < 4; ++j) t[j * 4 + i] = m[i * 4 + j];
  }
  return t;
}

Matrix4 Inverse(const Matrix4& m, const std::string& subject) {
  RequireFinite(m, subject);
  // Gauss-Jordan with pivoting over the columns.
  Matrix4 a = m, inverse = kIdentity4;
  for (size_t c = 0; c < 4; ++c) {
    size_t pivot = c;
    for (size_t r = c + 1; r < 4; ++r) {
      if (std::fabs(a[r * 4 + c]) > std::fabs(a[pivot * 4 + c])) pivot = r;
    }
    if (a[pivot * 4 + c] == 0) throw Error(subject, "found a singular matrix, expected one with an inverse");
    for (size_t k = 0; k < 4; ++k) {
      std::swap(a[c * 4 + k], a[pivot * 4 + k]);
      std::swap(inverse[c * 4 + k], inverse[pivot * 4 + k]);
    }
    const double scale = 1 / a[c * 4 + c];
    for (size_t k = 0; k < 4; ++k) a[c * 4 + k] *= scale, inverse[c * 4 + k] *= scale;
    for (size_t r = 0; r < 4; ++r) {
      if (r == c) continue;
      const double f = a[r * 4 + c];
      for (size_t k = 0; k < 4; ++k) {
        a[r * 4 + k] -= f * a[c * 4 + k];
        inverse[r * 4 + k] -= f * inverse[c * 4 + k];
      }
    }
  }
  const Matrix4 unit = Product(m, inverse);
  for (size_t i = 0; i < 16; ++i) {
    if (!(std::fabs(unit[i] - kIdentity4[i]) < 1e-6)) {
      throw Error(subject, "found a matrix that is singular within rounding, expected one with an inverse");
    }
  }
  return inverse;
}

std::array<double, 4> Transform(const Matrix4& m, const Vector3& p) {
  std::array<double, 4> r;
  for (size_t i = 0; i < 4; ++i)
    r[i] = m[i * 4] * p[0] + m[i * 4 + 1] * p[1] + m[i * 4 + 2] * p[2] + m[i * 4 + 3];
  return r;
}
double Dot(const Vector3& a, const Vector3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector3 Cross(const Vector3& a, const Vector3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vector3 Normalized(const Vector3& v) {
  const double length = Length(v);
  return length > 0 ? Times(v, 1 / length) : Vector3{};
}

Camera::Camera() : Camera(kIdentity4, Matrix4{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1}) {}

Camera::Camera(const Matrix4& world_to_clip, const std::string& subject)
    : world_to_camera_(kIdentity4), world_to_clip_(world_to_clip) {
  SetUp(subject);
}

Camera::Camera(const Matrix4& world_to_camera, const Matrix4& world_to_clip, const std::string& subject)
    : world_to_camera_(world_to_camera), world_to_clip_(world_to_clip), has_camera_(true) {
  RequireFinite(world_to_camera, subject);
  SetUp(subject);
}

void Camera::SetUp(const std::string& subject) {
  RequireFinite(world_to_clip_, subject);
  Matrix4& m = world_to_clip_;
  const Vector3 x = Row(m, 0), y = Row(m, 1), w = Row(m, 3);
  // A perspective matrix scaled as a whole projects the same; w of length 1 makes it the planar depth.
  perspective_ = Length(w) > 1e-12 * std::fabs(m[15]);
  const Vector3 across = Cross(x, y);
  if (!(Length(across) > 0)) {
    throw Error(subject,
                "found a matrix whose x and y rows do not span an image, expected world to clip space");
  }
  if (perspective_) {
    const double scale = 1 / Length(w), det = Dot(w, across) * scale;
    forward_ = Times(w, scale);
    if (!(std::fabs(det) > 1e-12 * Length(across))) {
      throw Error(subject, "found a singular matrix, expected a projection from world to clip space");
    }
    // The eye is where the planes x = 0, y = 0 and w = 0 meet; a ray lies in x = clip_x w and y = clip_y w.
    const Vector3 yw = Cross(y, w), wx = Cross(w, x);
    const double volume = Dot(w, across);
    for (size_t i = 0; i < 3; ++i) {
      eye_[i] = -(m[3] * yw[i] + m[7] * wx[i] + m[15] * across[i]) / volume;
      origin_[0][i] = eye_[i], origin_[1][i] = 0, origin_[2][i] = 0;
      direction_[0][i] = across[i] / det;
      direction_[1][i] = yw[i] / det;
      direction_[2][i] = wx[i] / det;
    }
  } else {
    // Along the common perpendicular of x and y; which way is decided by the camera's z, else by clip z.
    forward_ = Normalized(across);
    const Vector3 z = Row(m, 2);
    const double along = has_camera_ ? -Dot(Row(world_to_camera_, 2), forward_) : Dot(z, forward_);
    if (!(std::fabs(along) > 0)) {
      throw Error(subject,
                  "found a parallel projection without a direction of depth, expected an invertible matrix");
    }
    if (along < 0) forward_ = Times(forward_, -1);
    // Points of depth 0: on the camera's own plane z = 0, or where the clip volume begins.
    const Vector3 plane = has_camera_ ? Row(world_to_camera_, 2) : z;
    const double offset = has_camera_ ? world_to_camera_[11] : m[11] + m[15];
    const Vector3 yp = Cross(y, plane), px = Cross(plane, x);
    const double volume = Dot(plane, across);
    for (size_t i = 0; i < 3; ++i) {
      eye_[i] = -(m[3] * yp[i] + m[7] * px[i] + offset * across[i]) / volume;
      origin_[0][i] = eye_[i];
      origin_[1][i] = m[15] * yp[i] / volume;
      origin_[2][i] = m[15] * px[i] / volume;
      direction_[0][i] = forward_[i], direction_[1][i] = 0, direction_[2][i] = 0;
    }
  }
  if (has_camera_) return;
  // Eye space of its own: x right along the image's rows.
  const Vector3 back = Times(forward_, -1);
  const Vector3 up = Normalized(Cross(back, Normalized(Plus(x, forward_, -Dot(x, forward_)))));
  world_to_camera_ = LookAt(eye_, Plus(eye_, forward_, 1), up);
}

Camera Camera::Perspective(const Vector3& eye, const Vector3& target, const Vector3& up, double field_of_view,
                           double aspect, double near, double far) {
  RequireRange(near, far, aspect);
  if (!(field_of_view > 0 && field_of_view < 180) || !(near > 0)) {
    throw Error("camera", "found a field of view of " + base::NumberText(field_of_view) + " and near " +
                              base::NumberText(near) +
                              ", expected between 0 and 180 degrees and a positive distance");
  }
  const Matrix4 view = LookAt(eye, target, up);
  const double f = 1 / std::tan(field_of_view * std::numbers::pi / 360);
  const Matrix4 projection = {
      f / aspect, 0, 0,  0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), 2 * far * near / (near - far),
      0,          0, -1, 0};
  return Camera(view, Product(projection, view));
}

Camera Camera::Parallel(const Vector3& eye, const Vector3& target, const Vector3& up, double height,
                        double aspect, double near, double far) {
  RequireRange(near, far, aspect);
  if (!(height > 0))
    throw Error("camera", "found height " + base::NumberText(height) + ", expected a positive one");
  const Matrix4 view = LookAt(eye, target, up);
  const Matrix4 projection = {
      2 / (height * aspect),       0, 0, 0, 0, 2 / height, 0, 0, 0, 0, 2 / (near - far),
      (far + near) / (near - far), 0, 0, 0, 1};
  return Camera(view, Product(projection, view));
}

Camera Camera::FromNumbers(std::span<const double> numbers, const std::string& subject) {
  if (numbers.size() != 16 && numbers.size() != 32) {
    throw Error(subject, "found " + std::to_string(numbers.size()) +
                             " numbers, expected 16 (world to clip) or 32 (world to camera, world to clip)");
  }
  Matrix4 first, second;
  std::copy(numbers.begin(), numbers.begin() + 16, first.begin());
  if (numbers.size() == 16) return Camera(first, subject);
  std::copy(numbers.begin() + 16, numbers.end(), second.begin());
  return Camera(first, second, subject);
}

std::optional<Camera> Camera::FromMetadata(const ImageSpec& spec) {
  const Attribute* clip = FindMatrix(spec, kClipNames);
  if (clip == nullptr) return std::nullopt;
  const Attribute* camera = FindMatrix(spec, kCameraNames);
  if (camera == nullptr) return Camera(FromAttribute(*clip), "worldToNDC");
  return Camera(FromAttribute(*camera), FromAttribute(*clip), "worldToNDC");
}

void Camera::ToMetadata(ImageSpec& spec) const {
  auto items = std::make_shared<std::vector<Attribute>>();
  const Attribute* old[] = {FindMatrix(spec, kClipNames), FindMatrix(spec, kCameraNames)};
  if (spec.metadata) {
    for (const Attribute& a : *spec.metadata) {
      if (&a != old[0] && &a != old[1]) items->push_back(a);
    }
  }
  items->push_back(ToAttribute("worldToCamera", world_to_camera_));
  items->push_back(ToAttribute("worldtoscreen", world_to_clip_));
  spec.metadata = std::move(items);
}

Camera::Ray Camera::RayAt(double clip_x, double clip_y) const {
  return {Plus(Plus(origin_[0], origin_[1], clip_x), origin_[2], clip_y),
          Plus(Plus(direction_[0], direction_[1], clip_x), direction_[2], clip_y)};
}
Camera::Ray Camera::PixelRay(const Roi& window, double x, double y) const {
  const auto clip = ClipOfPixel(window, x, y);
  return RayAt(clip[0], clip[1]);
}
double Camera::DistancePerDepth(double clip_x, double clip_y) const {
  return Length(RayAt(clip_x, clip_y).direction);
}
Vector3 Camera::PointAt(double clip_x, double clip_y, double depth) const {
  const Ray ray = RayAt(clip_x, clip_y);
  return Plus(ray.origin, ray.direction, depth);
}
std::optional<Camera::Planes> Camera::ClipPlanes() const {
  const Vector3 z = Row(world_to_clip_, 2);
  const Vector3 aside = Plus(z, forward_, -Dot(z, forward_));
  if (!(Length(z) > 0) || !(Length(aside) <= 1e-5 * Length(z))) return std::nullopt;
  // Clip z and w are affine in the depth along a ray.
  const Ray ray = RayAt(0, 0);
  const auto at = Transform(world_to_clip_, ray.origin);
  const auto next = Transform(world_to_clip_, Plus(ray.origin, ray.direction, 1));
  const double z0 = at[2], z1 = next[2] - z0, w0 = at[3], w1 = next[3] - w0;
  // Endless where they grow alike, within the roundings of a file's floats.
  const bool endless = perspective_ && std::fabs(w1 - z1) <= 1e-6 * std::fabs(w1);
  const Planes planes{-(z0 + w0) / (z1 + w1), endless ? INFINITY : (z0 - w0) / (w1 - z1)};
  if (!std::isfinite(planes.near) || !(planes.near < planes.far)) return std::nullopt;
  if (perspective_ ? !(planes.near > 0) : !std::isfinite(planes.far)) return std::nullopt;
  return planes;
}
double Camera::PlanarDepth(const Vector3& p) const { return Dot(forward_, Plus(p, eye_, -1)); }
double Camera::Distance(const Vector3& p) const {
  return perspective_ ? Length(Plus(p, eye_, -1)) : PlanarDepth(p);
}

std::array<double, 2> ClipOfPixel(const Roi& window, double x, double y) {
  return {(x + 0.5 - window.x0) / window.width() * 2 - 1, 1 - (y + 0.5 - window.y0) / window.height() * 2};
}

double PlanarOfWindow(double window_depth, double near, double far) {
  if (std::isinf(far)) return near / (1 - window_depth);
  return near * far / (far - window_depth * (far - near));
}
double WindowOfPlanar(double planar_depth, double near, double far) {
  if (std::isinf(far)) return 1 - near / planar_depth;
  return (far - near * far / planar_depth) / (far - near);
}

}  // namespace tessera
