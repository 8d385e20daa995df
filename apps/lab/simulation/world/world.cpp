#include "apps/lab/simulation/world/world.hpp"

#include <array>

namespace km {
namespace {

LabelClass entry(SurfaceClass surface, const char* name, std::array<std::uint8_t, 3> color) {
  return {static_cast<LabelId>(surface), name, color};
}

}  // namespace

const LabelPalette& simulation_palette() {
  static const LabelPalette palette({
      entry(SurfaceClass::kUnknown, "unknown", {0, 0, 0}),
      entry(SurfaceClass::kSky, "sky", {112, 176, 232}),
      entry(SurfaceClass::kBuilding, "building", {150, 90, 70}),
      entry(SurfaceClass::kRoad, "road", {96, 64, 128}),
      entry(SurfaceClass::kSidewalk, "sidewalk", {244, 35, 232}),
      entry(SurfaceClass::kTerrain, "terrain", {152, 251, 152}),
      entry(SurfaceClass::kVegetation, "vegetation", {70, 142, 35}),
      entry(SurfaceClass::kVehicle, "vehicle", {20, 40, 200}),
      entry(SurfaceClass::kPole, "pole", {250, 220, 0}),
      entry(SurfaceClass::kFence, "fence", {190, 153, 153}),
      entry(SurfaceClass::kTent, "tent", {0, 130, 120}),
      entry(SurfaceClass::kPerson, "person", {220, 20, 60}),
      entry(SurfaceClass::kWall, "wall", {200, 196, 170}),
      entry(SurfaceClass::kFloor, "floor", {90, 110, 130}),
      entry(SurfaceClass::kCeiling, "ceiling", {235, 235, 245}),
      entry(SurfaceClass::kFurniture, "furniture", {230, 130, 20}),
      entry(SurfaceClass::kCurtain, "curtain", {130, 0, 160}),
      entry(SurfaceClass::kObject, "object", {0, 220, 220}),
  });
  return palette;
}

}  // namespace km
