#include "modules/evaluation/mesh/mesh_checks.hpp"

#include <bitset>
#include <cmath>
#include <stdexcept>

#include "modules/evaluation/mesh/surface_samples.hpp"

namespace km {

void check_comparable(const LabelledMesh& mesh, const std::string& name) {
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument(name + ": " + why);
  };
  const std::string vertices = std::to_string(mesh.vertices.size());
  if (mesh.faces.empty()) refuse("no faces, so no surface to compare");
  for (const auto& face : mesh.faces)
    for (const std::uint32_t corner : face)
      if (corner >= mesh.vertices.size())
        refuse("a face names vertex " + std::to_string(corner) + " of " + vertices);
  if (!mesh.labels.empty() && mesh.labels.size() != mesh.vertices.size())
    refuse(std::to_string(mesh.labels.size()) + " labels for " + vertices + " vertices");
  const double area = surface_area(mesh);
  if (!std::isfinite(area)) refuse("coordinates that are not finite");
  if (!(area > 0.0)) refuse("its faces have no area");
}

void check_labels(const LabelledMesh& mesh, const std::string& name, const LabelPalette& palette,
                  const std::string& palette_name) {
  std::bitset<256> used;
  for (const LabelId label : mesh.labels) used.set(label);
  for (std::size_t id = 1; id < used.size(); ++id)
    if (used[id] && palette.find(static_cast<LabelId>(id)) == nullptr)
      throw std::invalid_argument(name + ": label " + std::to_string(id) + " is not in " +
                                  palette_name);
}

void check(const MeshErrorOptions& options) {
  const auto positive = [](double value, const char* what) {
    if (!(value > 0.0) || !std::isfinite(value))
      throw std::invalid_argument(std::string(what) + " must be positive, not " +
                                  std::to_string(value));
  };
  positive(options.samples_per_m2, "samples per square metre");
  positive(static_cast<double>(options.max_samples), "the largest number of samples");
  positive(options.crop_m, "the crop distance");
  positive(options.label_distance_m, "the distance up to which labels are judged");
  positive(options.registration.reach_m, "the reach of registration");
  positive(options.registration.gate_m, "the gate of registration");
}

}  // namespace km
