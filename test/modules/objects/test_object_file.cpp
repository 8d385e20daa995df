#include <catch2/catch.hpp>

#include "modules/core/write_file.hpp"
#include "modules/objects/object_file.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

TEST_CASE("Objects are read as they were written", "[objects]") {
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

TEST_CASE("Objects with an unusable entry are refused with its place", "[objects]") {
  const TemporaryFolder folder;
  const auto refuses = [&](const auto& read, const std::string& text, const std::string& place) {
    CAPTURE(text);
    const auto file = folder.write("objects.json", text);
    CHECK_THROWS_WITH(read(file), Catch::Contains(file.string() + place));
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

}  // namespace
}  // namespace km
