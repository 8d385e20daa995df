#include "modules/core/io/write_file.hpp"
#include "modules/objects/object_box.hpp"
#include "modules/objects/object_file.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

TEST_CASE("Objects are read as they were written") {
  const TemporaryFolder folder;
  const auto file = folder.path() / "objects.json";
  const LabelPalette palette({{7, "chair", {1, 2, 3}}});
  const ObjectBox box{{1.0, 2.0, 0.5}, 0.3, {0.8, 0.5, 1.0}};
  write_file(file, objects_json({.anchor = 2,
                                 .objects = {{.label = 7, .box = box, .robots = {0, 3}},
                                             {.label = 9, .box = box}}},
                                palette));
  const auto objects = read_objects(file);
  REQUIRE(objects.size() == 2);
  CHECK(objects[0].name == "chair");
  CHECK(objects[1].name == "label 9");
  CHECK(objects[0].box.center == box.center);
  CHECK(objects[0].box.yaw_rad == box.yaw_rad);
  CHECK(objects[0].box.size_m == box.size_m);
  const ObjectList list = read_object_list(file);
  CHECK(list.anchor == 2);
  REQUIRE(list.objects.size() == 2);
  CHECK(list.objects[0].label == 7);
  CHECK(list.objects[0].box.center == box.center);
  CHECK(list.objects[0].robots == std::vector<RobotId>{0, 3});
}

TEST_CASE("Objects with an unusable entry are refused with its place") {
  const TemporaryFolder folder;
  const auto refuses = [&](const auto& read, const std::string& text, const std::string& place) {
    CAPTURE(text);
    const auto file = folder.write("objects.json", text);
    CHECK_THROWS_WITH(read(file), Contains(file.string() + place));
  };
  const std::string box = R"(, "center_m": [0, 0, 0], "yaw_rad": 0, "size_m": [1, 1, 1]}]})";
  for (const char* entry : {R"("label": 256, "robots": [])", R"("label": -1, "robots": [])",
                            R"("label": 1, "robots": [65536])", R"("label": 1)"})
    refuses(read_object_list, std::string(R"({"anchor": 0, "objects": [{)") + entry + box,
            ": entry 0 of");
  refuses(read_object_list, R"({"anchor": "a", "objects": []})", ": \"anchor\"");
  const std::string room = R"({"objects": [{"layer": "room"}, )";
  refuses(read_objects, room + R"({"class": "chair", "center_m": [0, 0], "yaw_rad": 0}]})",
          ": entry 1 of");
  refuses(read_objects, room + R"({"class": 5}]})", ": entry 1 of");
  refuses(read_objects, "[]", "");
}

TEST_CASE("The enclosing box of the corners of a box is that box") {
  const double yaw = GENERATE(-1.5, -0.3, 0.0, 0.7, 1.5);
  const ObjectBox box{{3.0, -4.0, 0.5}, yaw, {2.0, 0.7, 1.2}};
  const auto corners = corners_of(box);
  const ObjectBox found = enclosing_box(corners);
  CHECK((found.center - box.center).norm() < 1e-9);
  CHECK((found.size_m - box.size_m).norm() < 1e-9);
  CHECK(found.yaw_rad == Approx(yaw).margin(1e-9));
}

TEST_CASE("Shared volumes agree with counted points") {
  const auto seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto any = [&] {
    const double x = unit(random), y = unit(random), z = unit(random), yaw = 1.5 * unit(random);
    const double a = unit(random), b = unit(random), c = unit(random);
    return ObjectBox{{x, y, z}, yaw, {2.0 + a, 1.5 + b, 2.0 + c}};
  };
  const ObjectBox a = any(), b = any();
  const SE3 T_b_a = b.pose().inverse() * a.pose();
  int inside = 0;
  constexpr int kPoints = 20000;
  for (int i = 0; i < kPoints; ++i) {
    const double x = unit(random), y = unit(random), z = unit(random);
    const Eigen::Vector3d p_a = 0.5 * a.size_m.cwiseProduct(Eigen::Vector3d(x, y, z));
    inside += ((T_b_a * p_a).cwiseAbs().array() <= 0.5 * b.size_m.array()).all() ? 1 : 0;
  }
  const double share = static_cast<double>(inside) / kPoints;
  CHECK(shared_volume_m3(a, b) / a.volume_m3() == Approx(share).margin(0.02));
  CHECK(shared_volume_m3(b, a) == Approx(shared_volume_m3(a, b)).margin(1e-9));
}

}  // namespace
}  // namespace km
