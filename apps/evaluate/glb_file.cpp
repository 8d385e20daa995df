#include "apps/evaluate/glb_file.hpp"

#define TINYGLTF_NO_INCLUDE_STB_IMAGE
#define TINYGLTF_NO_INCLUDE_STB_IMAGE_WRITE
#include <tiny_gltf.h>

#include <cmath>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "modules/core/io/write_file.hpp"

namespace km {
namespace {

// glTF materials have linear colours (IEC 61966-2-1).
double linear(std::uint8_t srgb) {
  const double value = srgb / 255.0;
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

class GlbMesh {
 public:
  GlbMesh(const LabelledMesh& mesh, const LabelPalette& palette) : mesh_(mesh), palette_(palette) {
    model_.asset.version = "2.0";
    model_.asset.generator = "kimera_multi";
    model_.buffers.emplace_back();
    add_vertices();
    std::map<LabelId, std::vector<std::uint32_t>> corners;
    for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
      auto& list = corners[mesh.face_label(f)];
      list.insert(list.end(), mesh.faces[f].begin(), mesh.faces[f].end());
    }
    for (const auto& [label, indices] : corners) add_primitive(label, indices);
    model_.meshes.push_back(std::move(body_));
    tinygltf::Node node;
    node.mesh = 0;
    node.rotation = {-std::sqrt(0.5), 0.0, 0.0, std::sqrt(0.5)};  // x y z w: z up to y up
    model_.nodes.push_back(std::move(node));
    model_.scenes.emplace_back().nodes = {0};
    model_.defaultScene = 0;
  }

  [[nodiscard]] const tinygltf::Model& model() const { return model_; }

 private:
  // Appends an array of elements to the buffer. Returns the number of its accessor.
  template <typename T>
  int add_array(const std::vector<T>& values, std::size_t count, int component, int type,
                int target) {
    auto& bytes = model_.buffers[0].data;
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = bytes.size();
    view.byteLength = values.size() * sizeof(T);
    view.target = target;
    const auto* const first = reinterpret_cast<const unsigned char*>(values.data());
    bytes.insert(bytes.end(), first, first + view.byteLength);
    bytes.resize((bytes.size() + 3) / 4 * 4);
    tinygltf::Accessor accessor;
    accessor.bufferView = static_cast<int>(model_.bufferViews.size());
    accessor.componentType = component;
    accessor.type = type;
    accessor.count = count;
    model_.bufferViews.push_back(std::move(view));
    model_.accessors.push_back(std::move(accessor));
    return static_cast<int>(model_.accessors.size()) - 1;
  }

  void add_vertices() {
    std::vector<float> positions;
    Eigen::Vector3f low = mesh_.vertices[0], high = low;
    for (const Eigen::Vector3f& p : mesh_.vertices) {
      positions.insert(positions.end(), p.begin(), p.end());
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    attributes_["POSITION"] =
        add_array(positions, mesh_.vertices.size(), TINYGLTF_COMPONENT_TYPE_FLOAT,
                  TINYGLTF_TYPE_VEC3, TINYGLTF_TARGET_ARRAY_BUFFER);
    model_.accessors[0].minValues.assign(low.begin(), low.end());
    model_.accessors[0].maxValues.assign(high.begin(), high.end());
    std::vector<float> normals;
    for (const Eigen::Vector3f& normal : mesh_.normals())
      normals.insert(normals.end(), normal.begin(), normal.end());
    attributes_["NORMAL"] = add_array(normals, mesh_.vertices.size(), TINYGLTF_COMPONENT_TYPE_FLOAT,
                                      TINYGLTF_TYPE_VEC3, TINYGLTF_TARGET_ARRAY_BUFFER);
    if (mesh_.colors.empty()) return;
    std::vector<float> colors;
    for (const auto& color : mesh_.colors)
      for (const std::uint8_t channel : color)
        colors.push_back(static_cast<float>(linear(channel)));
    attributes_["COLOR_0"] = add_array(colors, mesh_.vertices.size(), TINYGLTF_COMPONENT_TYPE_FLOAT,
                                       TINYGLTF_TYPE_VEC3, TINYGLTF_TARGET_ARRAY_BUFFER);
  }

  void add_primitive(LabelId label, const std::vector<std::uint32_t>& indices) {
    tinygltf::Primitive primitive;
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    primitive.attributes = attributes_;
    primitive.material = static_cast<int>(model_.materials.size());
    primitive.indices = add_array(indices, indices.size(), TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT,
                                  TINYGLTF_TYPE_SCALAR, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
    body_.primitives.push_back(std::move(primitive));
    tinygltf::Material material;
    const LabelClass* const known = mesh_.labels.empty() ? nullptr : palette_.find(label);
    material.name = known != nullptr       ? known->name
                    : mesh_.labels.empty() ? "mesh"
                                           : "label " + std::to_string(label);
    if (known != nullptr && mesh_.colors.empty()) {
      const auto& [red, green, blue] = known->color;
      material.pbrMetallicRoughness.baseColorFactor = {linear(red), linear(green), linear(blue),
                                                       1.0};
    }
    material.pbrMetallicRoughness.metallicFactor = 0.0;
    material.doubleSided = true;
    model_.materials.push_back(std::move(material));
  }

  const LabelledMesh& mesh_;
  const LabelPalette& palette_;
  tinygltf::Model model_;
  tinygltf::Mesh body_;
  std::map<std::string, int> attributes_;
};

}  // namespace

void write_glb(const std::filesystem::path& file, const LabelledMesh& mesh,
               const LabelPalette& palette) {
  if (mesh.faces.empty())
    throw std::invalid_argument(file.string() + ": a mesh without faces cannot be exported");
  const GlbMesh glb(mesh, palette);
  std::ostringstream out;
  tinygltf::TinyGLTF writer;
  if (!writer.WriteGltfSceneToStream(&glb.model(), out, false, true))
    throw std::runtime_error(file.string() + ": tinygltf cannot write the mesh");
  write_file(file, out.view());
}

}  // namespace km
