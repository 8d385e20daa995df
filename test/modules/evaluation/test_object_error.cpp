#include "modules/evaluation/objects/object_error.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

NamedObject thing(const char* name, double x, double length = 1.0) {
  return {name, {{x, 0.0, 0.5}, 0.0, {length, 1.0, 1.0}}};
}

TEST_CASE("Objects are matched by class and overlap, each once") {
  const std::vector<NamedObject> truth = {thing("chair", 0.0), thing("chair", 5.0),
                                          thing("chair", 20.0), thing("table", 10.0)};
  const std::vector<NamedObject> estimates = {thing("chair", 0.0, 0.5),  // half of the first chair
                                              thing("chair", 0.1),       // better: 0.9 / 1.1
                                              thing("chair", 10.0),      // a table
                                              thing("chair", 20.0),  // a chair that does not count
                                              thing("lamp", 5.0)};
  const ObjectScores scores = score_objects(truth, estimates, {true, true, false, true}, 0.25);
  REQUIRE(scores.size() == 4);
  const ObjectScore& chairs = scores[0];
  CHECK(chairs.name == "chair");
  CHECK(chairs.true_objects == 2);
  CHECK(chairs.found == 1);
  CHECK(chairs.recall() == 0.5);
  CHECK(chairs.estimates == 4);
  CHECK(chairs.right == 2);
  CHECK(chairs.precision() == 0.5);
  CHECK(chairs.mean_overlap == Approx(0.5 * (0.9 / 1.1 + 1.0)));
  CHECK(scores[1].name == "lamp");
  CHECK(scores[1].precision() == 0.0);
  CHECK(scores[2].name == "table");
  CHECK(scores[2].recall() == 0.0);
  CHECK(scores[3].name == "all");
  CHECK(scores[3].estimates == 5);
  CHECK(scores[3].true_objects == 3);
  CHECK(score_objects(truth, estimates, {true, true, false, true}, 0.9).back().right == 1);
  CHECK_THROWS_AS(score_objects(truth, estimates, {true}, 0.25), std::invalid_argument);
}

TEST_CASE("The mapped surface of an object excludes the ground and other objects") {
  LabelledMesh mesh;
  const auto add_square = [&](const Eigen::Vector3f& a, const Eigen::Vector3f& u,
                              const Eigen::Vector3f& v) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), {a, a + u, a + u + v, a + v});
    mesh.faces.push_back({first, first + 1, first + 2});
    mesh.faces.push_back({first, first + 2, first + 3});
  };
  add_square({-0.5F, -0.5F, 1.0F}, {1, 0, 0}, {0, 1, 0});   // top of the first
  add_square({-0.5F, -0.55F, 0.0F}, {1, 0, 0}, {0, 0, 1});  // side, 5 cm outside
  add_square({-0.5F, -0.5F, 0.0F}, {1, 0, 0}, {0, 1, 0});   // ground below
  const std::vector<NamedObject> objects = {thing("chair", 0.0), thing("chair", 5.0)};
  const auto areas = mapped_surfaces_m2(mesh, objects);
  CHECK(areas[0] == Approx(2.0));
  CHECK(areas[1] == 0.0);
}

}  // namespace
}  // namespace km
