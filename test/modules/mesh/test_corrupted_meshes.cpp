#include <catch2/catch.hpp>

#include "modules/core/input_file.hpp"
#include "modules/mesh/mesh_file.hpp"
#include "test/support/corrupted_input.hpp"

namespace km {
namespace {

const std::string kAscii =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
    "z\n"
    "property uchar label\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
    "0.5 0.25 0 1\n1.5 0 0 1\n0 1.5 0 2\n0 0 1.5 2\n3 0 1 2\n3 1 2 3\n";

LabelledMesh tetrahedron() {
  LabelledMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.labels = {1, 1, 2, 2};
  mesh.colors.assign(4, {10, 20, 30});
  mesh.faces = {{0, 1, 2}, {1, 2, 3}};
  return mesh;
}

std::string binary() {
  const TemporaryFolder folder;
  write_mesh(folder.path() / "mesh.ply", tetrahedron());
  return folder.read("mesh.ply");
}

}  // namespace

TEST_CASE("A corrupted PLY file is refused by name or is a mesh of finite numbers") {
  const TemporaryFolder folder;
  check_corrupted<InputFileError>(
      GENERATE(values<std::string>({kAscii, binary()})), "corrupted.ply",
      [&](const std::string& bytes) {
        const LabelledMesh mesh = read_mesh(folder.write("corrupted.ply", bytes));
        for (const auto& vertex : mesh.vertices) CHECK(vertex.squaredNorm() < 1e19F);
        for (const auto& face : mesh.faces)
          for (const std::uint32_t corner : face) CHECK(corner < mesh.vertices.size());
        CHECK((mesh.labels.empty() || mesh.labels.size() == mesh.vertices.size()));
        CHECK((mesh.colors.empty() || mesh.colors.size() == mesh.vertices.size()));
      });
}

TEST_CASE("A path that is no mesh file is refused by name") {
  check_no_files<InputFileError>(".ply", [](const auto& place) { (void)read_mesh(place); });
}

}  // namespace km
