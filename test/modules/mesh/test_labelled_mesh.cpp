#include "modules/core/io/input_file.hpp"
#include "modules/mesh/labelled_mesh.hpp"
#include "modules/mesh/mesh_file.hpp"
#include "test/support/corrupted_input.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

LabelledMesh triangle() {
  LabelledMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.labels = {3, 5, 5};
  mesh.faces = {{0, 1, 2}};
  return mesh;
}

TEST_CASE("Appending keeps faces on their vertices and fills the arrays that one mesh lacks") {
  LabelledMesh mesh = triangle();
  LabelledMesh other = triangle();
  other.labels.clear();
  other.colors.assign(3, {1, 2, 3});
  mesh.append(other);
  CHECK(mesh.faces[1] == LabelledMesh::Face{3, 4, 5});
  CHECK(mesh.labels == std::vector<LabelId>{3, 5, 5, 0, 0, 0});
  REQUIRE(mesh.colors.size() == 6);
  CHECK(mesh.colors[2] == LabelledMesh::Color{0, 0, 0});
  CHECK(mesh.colors[3] == LabelledMesh::Color{1, 2, 3});
}

fs::path write_text(const TemporaryFolder& folder, const std::string& text) {
  return folder.write("mesh.ply", text);
}

const std::string kAsciiHeader =
    "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 3\nproperty float x\n"
    "property double y\nproperty float z\nproperty int label\nelement face 1\n"
    "property list uchar int vertex_indices\nend_header\n";

TEST_CASE("A mesh is equal after writing and reading") {
  LabelledMesh mesh;
  mesh.vertices = {{0, 0.1F, -3e-7F}, {1e6F, 0, 0}, {0, 1, 0}, {1, 1, 1}};
  mesh.labels = {0, 255, 7, 1};
  mesh.colors = {{0, 1, 2}, {255, 254, 253}, {9, 9, 9}, {0, 0, 0}};
  mesh.faces = {{0, 1, 2}, {1, 3, 2}};
  if (GENERATE(false, true)) mesh = LabelledMesh{};
  const TemporaryFolder folder;
  write_mesh(folder.path() / "a.ply", mesh);
  const LabelledMesh read = read_mesh(folder.path() / "a.ply");
  CHECK(read.vertices == mesh.vertices);
  CHECK(read.labels == mesh.labels);
  CHECK(read.colors == mesh.colors);
  CHECK(read.faces == mesh.faces);
}

TEST_CASE("The three encodings of one recorded mesh give the same mesh") {
  const auto folder = shared_data("meshes");
  if (!folder) return;
  const LabelledMesh little = read_mesh(*folder / "platonic_shelf.ply");
  const LabelledMesh ascii = read_mesh(*folder / "platonic_shelf_ascii.ply");
  const LabelledMesh big = read_mesh(*folder / "platonic_shelf_big_endian.ply");
  REQUIRE(little.faces.size() > 10);
  CHECK(little.faces == ascii.faces);
  CHECK(little.vertices == big.vertices);
  CHECK(little.faces == big.faces);
  const LabelledMesh cube = read_mesh(*folder / "cube.ply");
  CHECK(cube.vertices.size() == 8);
  CHECK(cube.colors.size() == 8);
}

TEST_CASE("Text with mixed types is read, polygons become fans") {
  const TemporaryFolder folder;
  std::string text = kAsciiHeader + "0 0 0 4\n1 0 0 4\n1 1 0 9\n3 0 1 2\n";
  CHECK(read_mesh(write_text(folder, text)).labels == std::vector<LabelId>{4, 4, 9});
  text.replace(text.find("vertex 3"), 8, "vertex 4");
  text.replace(text.find("3 0 1 2"), 7, "0 1 0 9\n4 0 1 2 3");
  const LabelledMesh fan = read_mesh(write_text(folder, text));
  CHECK(fan.faces == std::vector<LabelledMesh::Face>{{0, 1, 2}, {0, 2, 3}});
}

TEST_CASE("A file that is no mesh is refused with the file and the reason") {
  const TemporaryFolder folder;
  const auto refuses = [&](const std::string& text, const std::string& why) {
    const auto file = write_text(folder, text);
    CHECK_THROWS_WITH(read_mesh(file), Contains("mesh.ply: ") && Contains(why));
  };
  refuses("", "end_header");
  refuses("solid stl\n", "not a PLY file");
  refuses("ply\n" + std::string(5000, 'x') + "\nend_header\n", "header without end_header");
  refuses("ply\nformat ascii 2.0\nelement vertex many\n", "line 3: bad element");
  refuses("ply\nformat ascii 1.0\nelement vertex 170000000\n",
          "line 3: 170000000 elements, at most 50000000 are read");
  refuses("ply\nelement vertex 0\nproperty float x\nend_header\n", "format");
  refuses("ply\nformat ascii 1.0\nelement void 9999999\nend_header\n", "without properties");
  refuses(kAsciiHeader + "0 0 0 4\n1 0 0 4\n", "ends before");
  refuses(kAsciiHeader + "0 0 0 4\n1 nan 0 4\n1 1 0 9\n3 0 1 2\n", "vertex 1 is not finite");
  refuses(kAsciiHeader + "0 0 0 4\n1 0 0 300\n1 1 0 9\n3 0 1 2\n", "label 300");
  refuses(kAsciiHeader + "0 0 0 4\n1 0 0 4\n1 1 0 9\n3 0 1 3\n", "names vertex 3");
  refuses(kAsciiHeader + "0 0 0 4\n1 0 0 4\n1 1 0 9\n2 0 1\n", "fewer than 3");
  refuses(kAsciiHeader + "0 0 0 4\n1 0 0 4\n1 1 0 9\n-3 0 1\n", "list of -3");
  CHECK_THROWS_WITH(read_mesh(folder.path() / "none.ply"), Contains("cannot be opened"));
}

TEST_CASE("A mesh that cannot be written leaves no file") {
  const TemporaryFolder folder;
  CHECK_THROWS_AS(write_mesh(folder.path() / "none" / "a.ply", {}), std::system_error);
  CHECK_THROWS_WITH(write_mesh(folder.path() / "mesh.xyz", {}), Contains("is not .ply"));
  CHECK_FALSE(fs::exists(folder.path() / "mesh.xyz"));
  fs::create_directory(folder.path() / "taken.ply");
  CHECK_THROWS_AS(write_mesh(folder.path() / "taken.ply", {}), std::system_error);
  CHECK_FALSE(fs::exists(folder.path() / "taken.ply.part"));
}

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

}  // namespace
}  // namespace km
