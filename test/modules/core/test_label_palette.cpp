#include "modules/core/map/label_palette.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

const std::string kHeader = "name,red,green,blue,alpha,id\n";

std::string read(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

bool equal(const std::vector<LabelClass>& a, const std::vector<LabelClass>& b) {
  return std::equal(
      a.begin(), a.end(), b.begin(), b.end(), [](const LabelClass& one, const LabelClass& other) {
        return one.id == other.id && one.name == other.name && one.color == other.color;
      });
}

}  // namespace

TEST_CASE("A palette returns its classes by id and by colour") {
  const LabelPalette palette({{7, "wall", {1, 2, 3}}, {0, "unknown", {0, 0, 0}}});
  REQUIRE(palette.classes().size() == 2);
  CHECK(palette.classes()[0].name == "unknown");
  REQUIRE(palette.find(7) != nullptr);
  CHECK(palette.find(7)->name == "wall");
  CHECK(palette.find(1) == nullptr);
  CHECK(palette.find(255) == nullptr);
  CHECK(palette.id_of({1, 2, 3}) == LabelId{7});
  CHECK(palette.id_of({0, 0, 0}) == LabelId{0});
  CHECK_FALSE(palette.id_of({3, 2, 1}));
  CHECK_FALSE(LabelPalette().id_of({0, 0, 0}));
}

TEST_CASE("The first of several colours of an id draws it and all of them mean it") {
  const LabelPalette palette = parse_label_palette(kHeader +
                                                       "furniture,10,20,30,255,4\n"
                                                       "chair,40,50,60,255,4\n"
                                                       "stool,10,20,30,255,4\n",
                                                   "a.csv");
  REQUIRE(palette.classes().size() == 1);
  CHECK(palette.find(4)->name == "furniture");
  CHECK(palette.find(4)->color == std::array<std::uint8_t, 3>{10, 20, 30});
  CHECK(palette.id_of({40, 50, 60}) == LabelId{4});
  CHECK(palette.entries().size() == 2);
}

TEST_CASE("A palette refuses one colour for two ids and names that no table can contain") {
  CHECK_THROWS_WITH(LabelPalette({{1, "wall", {9, 9, 9}}, {2, "floor", {9, 9, 9}}}),
                    Contains("9,9,9") && Contains("'floor'") && Contains("id 1 and id 2"));
  for (const std::string name : {"", "a,b", "a#b", "a\nb", " a", "a\t"}) {
    CAPTURE(name);
    CHECK_THROWS_AS(LabelPalette({{1, name, {9, 9, 9}}}), std::invalid_argument);
  }
}

TEST_CASE("A bad table is refused with its file, line and value") {
  const auto refused = [](const std::string& text, const std::string& expected) {
    CAPTURE(text);
    CHECK_THROWS_WITH(parse_label_palette(text, "labels.csv"),
                      Contains("labels.csv") && Contains(expected));
  };
  refused("", "first line is not 'name,red");
  refused("wall,1,2,3,255,4\n", "first line is not 'name,red");
  refused(kHeader + "wall,1,2,3,255\n", ":2: 'wall' with 5 fields");
  refused(kHeader + "\nwall,1,2,256,255,4\n", ":3: blue '256'");
  refused(kHeader + "wall,1,x,3,255,4\n", ":2: green 'x'");
  refused(kHeader + "wall,1,2,3,opaque,4\n", ":2: alpha 'opaque'");
  refused(kHeader + "wall,1,2,3,255,-1\n", ":2: id '-1'");
  refused(kHeader + ",1,2,3,255,1\n", ":2: the class has no name");
  refused(kHeader + "wall,1,2,3,255,4\nfloor,1,2,3,255,5\n",
          ":3: the colour 1,2,3 of 'floor' stands for id 5, but for id 4 in line 2");
}

TEST_CASE("A palette is equal after writing and reading CSV") {
  const LabelPalette palette({{3, "two words", {0, 128, 255}},
                              {255, "Missing", {255, 255, 255}},
                              {3, "alias", {1, 1, 1}},
                              {0, "unknown", {0, 0, 0}}});
  const LabelPalette copy = parse_label_palette(to_csv(palette), "copy");
  CHECK(equal(copy.entries(), palette.entries()));
  CHECK(equal(copy.classes(), palette.classes()));
  CHECK(copy.id_of({1, 1, 1}) == LabelId{3});
}

TEST_CASE("Kimera-Semantics' tables are read or refused with a reason") {
  const auto folder = shared_data("semantics");
  if (!folder) return;
  int read_count = 0;
  for (const auto& file : fs::directory_iterator(*folder)) {
    const std::string name = file.path().filename().string();
    CAPTURE(name);
    const std::string text = read(file.path());
    if (name == "mask_rcnn_mapping.csv") {  // only names, no colours
      CHECK_THROWS_WITH(parse_label_palette(text, name), Contains(":2: 'BG' with 2 fields"));
    } else if (name == "tesse_multiscene_office2_segmentation_mapping.csv") {
      CHECK_THROWS_WITH(parse_label_palette(text, name), Contains("stands for id"));
    } else {
      const LabelPalette palette = parse_label_palette(text, name);
      CHECK(palette.find(0) != nullptr);
      CHECK(equal(parse_label_palette(to_csv(palette), name).entries(), palette.entries()));
      ++read_count;
    }
  }
  CHECK(read_count == 9);
}

}  // namespace km
