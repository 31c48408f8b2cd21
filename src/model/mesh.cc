// Triangle meshes from Wavefront OBJ files.
#include "tessera/mesh.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "base/input_file.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"

namespace tessera {
namespace {

constexpr size_t kMostPoints = size_t{1} << 28;

// The words of one line, and where it stands, for messages.
class Line {
 public:
  Line(const std::string& file, int number, std::string_view text)
      : file_(file), number_(number), rest_(text) {
    rest_ = rest_.substr(0, rest_.find('#'));
  }
  std::string_view Word() {
    const size_t first = rest_.find_first_not_of(" \t\r");
    if (first == std::string_view::npos) return {};
    const size_t end = std::min(rest_.find_first_of(" \t\r", first), rest_.size());
    const std::string_view word = rest_.substr(first, end - first);
    rest_.remove_prefix(end);
    return word;
  }
  template <typename N>
  N Number(std::string_view word, const char* expected) const {
    N value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size())
      Refuse("\"" + std::string(word) + "\"", expected);
    return value;
  }
  [[noreturn]] void Refuse(const std::string& found, const std::string& expected) const {
    throw DataError(file_, "line " + std::to_string(number_) + ": found " + found + ", expected " + expected);
  }

 private:
  const std::string& file_;
  int number_;
  std::string_view rest_;
};

Vector3 PointOf(Line& line) {
  Vector3 p;
  for (double& c : p) {
    const std::string_view word = line.Word();
    c = line.Number<double>(word, "three finite coordinates");
    if (!std::isfinite(c)) line.Refuse(std::string(word), "three finite coordinates");
  }
  return p;
}

// Corners of a face, counted from 0; texture and normal indices behind slashes are skipped.
void AddFace(Line& line, Mesh& mesh) {
  std::vector<int> corners;
  const auto points = static_cast<int64_t>(mesh.points.size());
  for (std::string_view word = line.Word(); !word.empty(); word = line.Word()) {
    const auto index = line.Number<int64_t>(word.substr(0, word.find('/')), "a point's number");
    const int64_t corner = index < 0 ? points + index : index - 1;
    if (index == 0 || corner < 0 || corner >= points) {
      line.Refuse("point " + std::to_string(index),
                  "1 to " + std::to_string(points) + ", or as much below 0");
    }
    corners.push_back(static_cast<int>(corner));
  }
  if (corners.size() < 3)
    line.Refuse("a face of " + std::to_string(corners.size()) + " corners", "3 or more");
  for (size_t k = 2; k < corners.size(); ++k)
    mesh.triangles.push_back({corners[0], corners[k - 1], corners[k]});
}

}  // namespace

Mesh ReadMesh(const std::string& file) {
  base::InputFile stream(file, "a Wavefront OBJ file");
  Mesh mesh;
  int number = 0;
  for (std::string text; base::GetLine(stream, text, file, number + 1);) {
    Line line(file, ++number, text);
    const std::string_view kind = line.Word();
    if (kind == "v") {
      if (mesh.points.size() == kMostPoints) line.Refuse("more than 2^28 points", "fewer");
      mesh.points.push_back(PointOf(line));
    } else if (kind == "f") {
      AddFace(line, mesh);
    }
  }
  if (mesh.triangles.empty())
    throw DataError(file, "found no faces, expected a Wavefront OBJ file of lines v and f");
  return mesh;
}

void FitMesh(Mesh& mesh, double longest) {
  constexpr double kEndless = std::numeric_limits<double>::infinity();
  Vector3 low = {kEndless, kEndless, kEndless}, high = {-kEndless, -kEndless, -kEndless};
  for (const Vector3& p : mesh.points) {
    for (size_t a = 0; a < 3; ++a) low[a] = std::min(low[a], p[a]), high[a] = std::max(high[a], p[a]);
  }
  const double side = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  if (!(side > 0)) throw DataError("mesh", "found no extent, expected points that differ");
  for (Vector3& p : mesh.points) {
    for (size_t a = 0; a < 3; ++a) p[a] = (p[a] - 0.5 * (low[a] + high[a])) * longest / side;
  }
}

size_t OpenEdges(const Mesh& mesh) {
  // Exporters repeat points along seams of their texture coordinates.
  std::map<Vector3, int> places;
  std::vector<int> place;
  for (const Vector3& p : mesh.points)
    place.push_back(places.emplace(p, static_cast<int>(places.size())).first->second);
  std::vector<std::pair<int, int>> edges;
  for (const auto& triangle : mesh.triangles) {
    for (int corner : triangle) {
      if (corner < 0 || static_cast<size_t>(corner) >= place.size())
        throw DataError("mesh",
                        "found point " + std::to_string(corner) + " of " + std::to_string(place.size()));
    }
    for (size_t k = 0; k < 3; ++k) {
      const int from = place[static_cast<size_t>(triangle[k])],
                to = place[static_cast<size_t>(triangle[(k + 1) % 3])];
      if (from != to) edges.emplace_back(std::min(from, to), std::max(from, to));
    }
  }
  std::sort(edges.begin(), edges.end());
  size_t open = 0;
  for (size_t i = 0, end = 0; i < edges.size(); i = end) {
    while (end < edges.size() && edges[end] == edges[i]) ++end;
    open += (end - i) % 2;
  }
  return open;
}

}  // namespace tessera
