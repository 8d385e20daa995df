#define TINYGLTF_NO_INCLUDE_STB_IMAGE
#define TINYGLTF_NO_INCLUDE_STB_IMAGE_WRITE
#include <tiny_gltf.h>

#include "apps/evaluate/glb_file.hpp"
#include "test/modules/evaluation/mesh/shapes.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

tinygltf::Model read_glb(const fs::path& file) {
  tinygltf::Model model;
  tinygltf::TinyGLTF reader;
  std::string errors, warnings;
  REQUIRE(reader.LoadBinaryFromFile(&model, &errors, &warnings, file.string()));
  CHECK(errors + warnings == "");
  return model;
}

template <typename T>
std::vector<T> values_of(const tinygltf::Model& model, int accessor, std::size_t components) {
  const auto& array = model.accessors.at(static_cast<std::size_t>(accessor));
  const auto& view = model.bufferViews.at(static_cast<std::size_t>(array.bufferView));
  std::vector<T> values(array.count * components);
  REQUIRE(view.byteLength == values.size() * sizeof(T));
  std::memcpy(values.data(), model.buffers.at(0).data.data() + view.byteOffset, view.byteLength);
  return values;
}

TEST_CASE("A mesh is read back from glTF with its classes as materials") {
  const TemporaryFolder folder;
  const auto file = folder.path() / "room.glb";
  LabelledMesh mesh = room();
  const LabelPalette palette({{1, "floor", {255, 0, 128}}, {2, "west", {0, 10, 0}}});
  write_glb(file, mesh, palette);
  const tinygltf::Model model = read_glb(file);

  const auto& primitives = model.meshes.at(0).primitives;
  REQUIRE(primitives.size() == 5);
  const auto positions = values_of<float>(model, primitives[0].attributes.at("POSITION"), 3);
  REQUIRE(positions.size() == 3 * mesh.vertices.size());
  CHECK(std::memcmp(positions.data(), mesh.vertices.data(), positions.size() * sizeof(float)) == 0);
  CHECK(model.accessors[0].maxValues == std::vector<double>{4, 3, 2});
  CHECK_FALSE(primitives[0].attributes.contains("COLOR_0"));  // in the materials
  const auto normals = values_of<float>(model, primitives[0].attributes.at("NORMAL"), 3);
  CHECK(std::vector(normals.begin(), normals.begin() + 3) == std::vector{0.0F, 0.0F, 1.0F});
  std::size_t faces = 0;
  for (std::size_t i = 0; i < 5; ++i) {
    const auto indices = values_of<std::uint32_t>(model, primitives[i].indices, 1);
    faces += indices.size() / 3;
    for (const std::uint32_t v : indices) CHECK(mesh.labels.at(v) == i + 1);
  }
  CHECK(faces == mesh.faces.size());
  const auto material = [&](std::size_t i) {
    return model.materials.at(static_cast<std::size_t>(primitives[i].material));
  };
  CHECK(material(0).name == "floor");
  CHECK(material(1).name == "west");
  CHECK(material(4).name == "label 5");
  const auto color = material(0).pbrMetallicRoughness.baseColorFactor;
  CHECK(color[0] == Approx(1.0));
  CHECK(color[1] == 0.0);
  CHECK(color[2] == Approx(0.2158605));  // linear value of 128, IEC 61966-2-1
  // The node turns the z axis of the mesh to the y axis of glTF.
  const auto q = model.nodes.at(0).rotation;
  const Eigen::Quaterniond rotation(q.at(3), q.at(0), q.at(1), q.at(2));
  CHECK((rotation * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d::UnitY()));

  mesh.colors.assign(mesh.vertices.size(), {9, 9, 9});  // colours of a camera
  write_glb(file, mesh, palette);
  const tinygltf::Model coloured = read_glb(file);
  CHECK(coloured.meshes.at(0).primitives[0].attributes.contains("COLOR_0"));
  CHECK(coloured.materials.at(0).pbrMetallicRoughness.baseColorFactor ==
        std::vector{1.0, 1.0, 1.0, 1.0});
}

TEST_CASE("A mesh without labels has one material and the colours of its vertices") {
  const TemporaryFolder folder;
  const auto file = folder.path() / "room.glb";
  LabelledMesh mesh = room();
  mesh.labels.clear();
  mesh.colors.assign(mesh.vertices.size(), {255, 0, 0});
  write_glb(file, mesh, {});
  const tinygltf::Model model = read_glb(file);
  REQUIRE(model.meshes.at(0).primitives.size() == 1);
  CHECK(model.materials.at(0).name == "mesh");
  const auto colors =
      values_of<float>(model, model.meshes[0].primitives[0].attributes.at("COLOR_0"), 3);
  CHECK(std::vector(colors.end() - 3, colors.end()) == std::vector<float>{1, 0, 0});
  CHECK_THROWS_WITH(write_glb("none.glb", {}, {}), Contains("none.glb"));
}

}  // namespace
}  // namespace km
