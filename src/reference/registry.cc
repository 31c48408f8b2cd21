// Finds an operation's reference function.
#include <map>
#include <mutex>
#include <utility>

#include "reference/reference.h"

namespace tessera::reference {

// Entries of each family, defined beside its functions.
std::vector<Entry> ColorEntries();
std::vector<Entry> ColorRemapEntries();
std::vector<Entry> BlendEntries();
std::vector<Entry> CompositeEntries();
std::vector<Entry> CurveEntries();
std::vector<Entry> AccumulateEntries();
std::vector<Entry> ArithmeticEntries();
std::vector<Entry> FlowEntries();
std::vector<Entry> ForeignEntries();
std::vector<Entry> GenerateEntries();
std::vector<Entry> FilterEntries();
std::vector<Entry> FillHolesEntries();
std::vector<Entry> OutlineEntries();
std::vector<Entry> NoiseEntries();
std::vector<Entry> ShapedSpotsEntries();
std::vector<Entry> SvgTurbulenceEntries();
std::vector<Entry> TextureEntries();
std::vector<Entry> TextureEnvironmentEntries();
std::vector<Entry> GeometryEntries();
std::vector<Entry> PlacesEntries();
std::vector<Entry> LookupEntries();
std::vector<Entry> ShadeEntries();
std::vector<Entry> ShadeLightEntries();
std::vector<Entry> SolidEntries();
std::vector<Entry> EnvironmentEntries();
std::vector<Entry> LightingEntries();
std::vector<Entry> BumpEntries();
std::vector<Entry> VolumeEntries();
std::vector<Entry> MeanEntries();
std::vector<Entry> ReliefEntries();
std::vector<Entry> ReprojectEntries();
std::vector<Entry> RestoreEntries();
std::vector<Entry> LightPointsEntries();
std::vector<Entry> SurfaceFieldEntries();

namespace {

// A map's nodes stay where they are, so pointers handed out by Find outlive later insertions.
struct Table {
  std::mutex mutex;
  std::map<std::string, Entry> entries;

  Table() {
    for (auto* family : {&AccumulateEntries,  &ColorEntries,       &ColorRemapEntries,
                         &BlendEntries,       &CompositeEntries,   &CurveEntries,
                         &ArithmeticEntries,  &FlowEntries,        &GenerateEntries,
                         &FilterEntries,      &FillHolesEntries,   &OutlineEntries,
                         &NoiseEntries,       &ShapedSpotsEntries, &SvgTurbulenceEntries,
                         &TextureEntries,     &GeometryEntries,    &LookupEntries,
                         &ShadeEntries,       &ShadeLightEntries,  &SolidEntries,
                         &EnvironmentEntries, &LightingEntries,    &BumpEntries,
                         &VolumeEntries,      &ForeignEntries,     &PlacesEntries,
                         &RestoreEntries,     &ReprojectEntries,   &TextureEnvironmentEntries,
                         &ReliefEntries,      &MeanEntries,        &SurfaceFieldEntries,
                         &LightPointsEntries}) {
      for (Entry& entry : family()) {
        std::string name = entry.op;
        entries.insert_or_assign(std::move(name), std::move(entry));
      }
    }
  }
};

Table& Entries() {
  static Table table;
  return table;
}

}  // namespace

const Entry* Find(const std::string& op) {
  Table& table = Entries();
  const std::lock_guard lock(table.mutex);
  const auto it = table.entries.find(op);
  return it == table.entries.end() ? nullptr : &it->second;
}

void Register(Entry entry) {
  Table& table = Entries();
  const std::lock_guard lock(table.mutex);
  std::string name = entry.op;
  table.entries.insert_or_assign(std::move(name), std::move(entry));
}

}  // namespace tessera::reference
