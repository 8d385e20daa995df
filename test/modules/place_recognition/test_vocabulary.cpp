#include <bit>

#include "modules/images/image_codec.hpp"
#include "modules/images/keypoint_extractor.hpp"
#include "modules/place_recognition/vocabulary.hpp"
#include "modules/place_recognition/vocabulary_file.hpp"
#include "modules/place_recognition/vocabulary_training.hpp"
#include "test/support/command.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Images = std::vector<std::vector<BinaryDescriptor>>;

constexpr float kFloatTolerance = 1e-6F;  // weights are floats of order one

int distance(const BinaryDescriptor& a, const BinaryDescriptor& b) {
  int bits = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    bits += std::popcount(static_cast<unsigned>(a[i] ^ b[i]));
  return bits;
}

// Images of the points of a world: each sighting changes some bits of the descriptor of a point.
class World {
 public:
  explicit World(unsigned seed) : rng_(seed) {
    for (BinaryDescriptor& point : points_)
      for (std::uint8_t& byte : point) byte = static_cast<std::uint8_t>(rng_());
  }

  std::vector<BinaryDescriptor> image(std::size_t sightings) {
    std::vector<BinaryDescriptor> result;
    for (std::size_t i = 0; i < sightings; ++i) {
      result.push_back(points_[rng_() % points_.size()]);
      for (int flip = 0; flip < 5; ++flip)
        result.back()[rng_() % 32] ^= static_cast<std::uint8_t>(1U << (rng_() % 8));
    }
    return result;
  }
  Images images(std::size_t number, std::size_t sightings) {
    Images result;
    for (std::size_t i = 0; i < number; ++i) result.push_back(image(sightings));
    return result;
  }

 private:
  std::mt19937 rng_;
  std::array<BinaryDescriptor, 500> points_;
};

// Descriptor whose first `bits` bits are set.
BinaryDescriptor ladder(int bits) {
  BinaryDescriptor descriptor{};
  for (int i = 0; i < bits; ++i)
    descriptor[static_cast<std::size_t>(i / 8)] |= static_cast<std::uint8_t>(1U << (i % 8));
  return descriptor;
}

// Index of the first child of every node.
std::vector<std::size_t> first_children(const VocabularyData& data) {
  std::vector<std::size_t> first;
  std::size_t next = 1;
  for (const std::uint8_t children : data.children) {
    first.push_back(next);
    next += children;
  }
  return first;
}

// The node a descriptor ends in, by plain comparison.
std::size_t leaf_of(const VocabularyData& data, const BinaryDescriptor& descriptor) {
  const std::vector<std::size_t> first = first_children(data);
  std::size_t node = 0;
  while (data.children[node] != 0) {
    std::size_t best = first[node];
    for (std::size_t c = best; c < first[node] + data.children[node]; ++c)
      if (distance(descriptor, data.centers[c]) < distance(descriptor, data.centers[best]))
        best = c;
    node = best;
  }
  return node;
}

std::uint32_t word_of_leaf(const VocabularyData& data, std::size_t leaf) {
  const auto end = data.children.begin() + static_cast<std::ptrdiff_t>(leaf);
  return static_cast<std::uint32_t>(std::count(data.children.begin(), end, std::uint8_t{0}));
}

TEST_CASE("A descriptor gets the word that plain descent finds") {
  const auto seed = GENERATE(1U, 2U, 3U);
  const int branching = GENERATE(2, 7, 10, 40);
  CAPTURE(seed, branching);
  World world(seed);
  const Vocabulary vocabulary(
      train_vocabulary(world.images(20, 100), {.branching = branching, .depth = 3, .seed = seed}));
  const auto image = world.image(301);
  const std::vector<std::uint32_t> words = vocabulary.words(image);
  REQUIRE(words.size() == image.size());
  for (std::size_t i = 0; i < image.size(); ++i)
    CHECK(words[i] == word_of_leaf(vocabulary.data(), leaf_of(vocabulary.data(), image[i])));
}

TEST_CASE("Few different descriptors become one word each") {
  const Images images = {{ladder(0), ladder(100), ladder(200), ladder(100), ladder(200)}};
  const VocabularyData data = train_vocabulary(images, {.branching = 5, .depth = 4});
  CHECK(data.children == std::vector<std::uint8_t>{3, 0, 0, 0});
  std::set<BinaryDescriptor> centers(data.centers.begin() + 1, data.centers.end());
  CHECK(centers == std::set{ladder(0), ladder(100), ladder(200)});
}

TEST_CASE("A centre is the bitwise majority of its cluster") {
  // Two far groups; in the first, bits 0-9 are set in 2 of 3 descriptors, bits 10-19 in 1 of 3.
  const Images images = {
      {ladder(0), ladder(10), ladder(20), ladder(240), ladder(250), ladder(256)}};
  const VocabularyData data = train_vocabulary(images, {.branching = 2, .depth = 1});
  REQUIRE(data.children == std::vector<std::uint8_t>{2, 0, 0});
  CHECK(std::set(data.centers.begin() + 1, data.centers.end()) ==
        std::set{ladder(10), ladder(250)});
}

TEST_CASE("Weights are term counts times ln(N / n), scaled to norm 1") {
  const BinaryDescriptor everywhere = ladder(0);
  const BinaryDescriptor in_two = ladder(100);
  const BinaryDescriptor in_one = ladder(200);
  const Images images = {{everywhere, in_two}, {everywhere, in_two, in_one}, {everywhere}};
  const Vocabulary vocabulary(train_vocabulary(images, {.branching = 3, .depth = 1}));
  const auto word = [&](const BinaryDescriptor& d) { return vocabulary.words({&d, 1})[0]; };
  const auto idf = [&](const BinaryDescriptor& d) { return vocabulary.data().idf[word(d)]; };
  CHECK(idf(everywhere) == 0.0F);
  CHECK(idf(in_two) == Approx(std::log(3.0 / 2.0)).epsilon(kFloatTolerance));
  CHECK(idf(in_one) == Approx(std::log(3.0)).epsilon(kFloatTolerance));

  const std::vector<BinaryDescriptor> image = {in_two, everywhere, in_two, in_one};
  const BowVector vector = vocabulary.transform(image);
  REQUIRE(vector.words.size() == 2);  // the word of every image has no weight
  const double total = 2.0 * std::log(1.5) + std::log(3.0);
  const std::size_t at = vector.words[0] == word(in_two) ? 0 : 1;
  CHECK(vector.weights[at] == Approx(2.0 * std::log(1.5) / total).epsilon(kFloatTolerance));
  CHECK(vector.weights[1 - at] == Approx(std::log(3.0) / total).epsilon(kFloatTolerance));
}

TEST_CASE("Training depends only on input and seed") {
  World world(5);
  const Images images = world.images(10, 200);
  const VocabularyTrainingConfig config{.branching = 6, .depth = 3, .seed = 11};
  const VocabularyData first = train_vocabulary(images, config);
  CHECK(train_vocabulary(images, config) == first);
  CHECK(train_vocabulary(images, {.branching = 6, .depth = 3, .seed = 12}) != first);
  CHECK(problem_of(first).empty());
}

TEST_CASE("An invalid vocabulary is refused with the reason") {
  CHECK_THROWS_WITH(train_vocabulary(Images{{}, {}}, {}), Contains("no descriptors"));
  CHECK_THROWS_WITH(train_vocabulary(Images{{ladder(3), ladder(3)}}, {}), Contains("are equal"));
  CHECK_THROWS_AS(train_vocabulary(Images{{ladder(3)}}, {.branching = 1}), ConfigError);

  const VocabularyData good = train_vocabulary(Images{{ladder(0), ladder(9)}}, {.depth = 1});
  VocabularyData bad = good;
  const auto check_refused = [&](const char* reason) {
    CHECK_THROWS_WITH(Vocabulary(bad), Contains(reason));
    bad = good;
  };
  bad.idf[1] = std::nanf("");
  check_refused("weight of word 1");
  bad.idf.push_back(0.0F);
  check_refused("3 weights for 2 words");
  bad.centers.pop_back();
  check_refused("2 centres for 3 nodes");
  bad.branching = 1;
  check_refused("node 0 has 2 children, branching is 1");
  bad.depth = 0;
  check_refused("depth 0 is outside");
  const auto check_tree_refused = [&](int branching, int depth, std::vector<std::uint8_t> children,
                                      const char* reason) {
    bad = {.branching = branching, .depth = depth, .children = std::move(children)};
    bad.centers.resize(bad.children.size());
    bad.idf.resize(static_cast<std::size_t>(std::ranges::count(bad.children, 0)));
    check_refused(reason);
  };
  check_tree_refused(2, 1, {2, 2, 0, 0, 0}, "node 1 at depth 1 has children");
  check_tree_refused(9, 1, {9, 0, 0}, "lie beyond the last node");
  check_tree_refused(9, 2, {1, 0, 0}, "node 2 has no parent");
}

VocabularyData small_vocabulary() {
  World world(1);
  return train_vocabulary(world.images(5, 40), {.branching = 4, .depth = 2});
}

TEST_CASE("A vocabulary survives its file, identity and scores included") {
  const VocabularyData data = small_vocabulary();
  const Vocabulary before(data);
  const TemporaryFolder folder;
  save_vocabulary(data, folder.path() / "v.kmvoc");
  const Vocabulary after = load_vocabulary(folder.path() / "v.kmvoc");
  CHECK(after.data() == data);
  CHECK(after.id() == before.id());
  World world(1);
  const auto image = world.image(100);
  CHECK(after.transform(image) == before.transform(image));
}

TEST_CASE("A truncated or overlong vocabulary is refused at every length") {
  const std::string bytes = serialize(small_vocabulary());
  for (std::size_t size = 0; size < bytes.size(); ++size)
    CHECK_THROWS_AS(deserialize(bytes.substr(0, size), "cut"), std::runtime_error);
  CHECK_THROWS_WITH(deserialize(bytes.substr(0, 39), "cut"),
                    Contains("vocabulary cut, offset 39: ends inside the header"));
  CHECK_THROWS_WITH(deserialize(bytes + 'x', "long"),
                    Contains("the header states " + std::to_string(bytes.size())));
}

TEST_CASE("A vocabulary with any byte changed is refused") {
  const std::string bytes = serialize(small_vocabulary());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (28 <= i && i < 32) continue;  // reserved
    CAPTURE(i);
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x04);
    CHECK_THROWS_AS(deserialize(damaged, "damaged"), std::runtime_error);
  }
}

TEST_CASE("A refusal names the file, the offset and what is wrong there") {
  const auto [offset, value, reason] = GENERATE(table<std::size_t, std::uint32_t, std::string>(
      {{0, 88, "offset 0: not a"},
       {8, 7, "offset 8: format version 7, known is 1"},
       {12, 256, "offset 12: branching 256"},
       {16, 0xFFFFFFFF, "offset 16: depth 4294967295"},
       {20, 0xFFFFFFFF, "offset 20: 4294967295 nodes"},  // 137 GB are not allocated
       {20, 1U << 26U, "but the header states"},
       {32, 1, "offset 32: the checksum"}}));
  std::string bytes = serialize(small_vocabulary());
  std::memcpy(bytes.data() + offset, &value, sizeof value);
  CHECK_THROWS_WITH(deserialize(bytes, "a/b"), Contains("vocabulary a/b, ") && Contains(reason));
  VocabularyData data = small_vocabulary();
  data.children[0] = 5;  // the checksum fits
  CHECK_THROWS_WITH(deserialize(serialize(data), "forged"),
                    Contains("offset 40: node 0 has 5 children, branching is 4"));
}

TEST_CASE("A missing file is named") {
  CHECK_THROWS_WITH(load_vocabulary("/nowhere/at.all"), Contains("/nowhere/at.all"));
  CHECK_THROWS_WITH(load_vocabulary("config"), Contains("config: a folder, not a file"));
  CHECK_THROWS_WITH(save_vocabulary(small_vocabulary(), "/nowhere/at.all"),
                    Contains("cannot be written"));
}

TEST_CASE("The shipped vocabulary loads, is the documented one, and is small") {
  constexpr std::size_t kMaxShippedBytes = 1'500'000;
  const fs::path file = "config/vocabulary/indoor.kmvoc";
  const Vocabulary vocabulary = load_vocabulary(file);
  std::ifstream readme("config/vocabulary/README.md");
  const std::string text(std::istreambuf_iterator<char>(readme), {});
  CHECK_THAT(text, Contains(fingerprint_text(vocabulary.id())));
  CHECK(fs::file_size(file) < kMaxShippedBytes);
  World world(1);
  const auto image = world.image(100);
  CHECK(score(vocabulary.transform(image), vocabulary.transform(image)) ==
        Approx(1.0).margin(1e-5));
}

CommandResult run_tool(const std::string& arguments) {
  return run_command(std::string(KM_BIN_DIR) + "/kimera_multi_vocabulary " + arguments);
}

// On real images, through the tool.
TEST_CASE("The tool trains on real images and distinguishes the two places") {
  const auto images = shared_data("kimera_vio_lcd");
  if (!images) return;
  const TemporaryFolder folder;
  const auto left = [&](int i) {
    return (*images / ("left_img_" + std::to_string(i) + ".png")).string();
  };
  const std::string vocabulary = (folder.path() / "v.kmvoc").string();
  const CommandResult trained = run_tool("train -k 9 -L 3 -o " + vocabulary + " " + left(0) + " " +
                                         left(1) + " " + left(2) + " " + left(3));
  INFO(trained.output);
  REQUIRE(trained.exit_code == 0);
  CHECK_THAT(trained.output, Contains("of 4 images"));

  const Vocabulary words = load_vocabulary(vocabulary);
  const auto bag_of = [&](int i) {
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
    make_keypoint_extractor(1000)->detectAndCompute(read_pixels(left(i), DecodedPixels::kGray),
                                                    cv::noArray(), keypoints, descriptors);
    return words.transform(descriptors_of_rows(descriptors));
  };
  const auto score_of = [&](int i, int k) { return score(bag_of(i), bag_of(k)); };
  CHECK(score_of(2, 2) == Approx(1.0).margin(1e-5));
  // 0, 1 and 2, 3 are pairs of one place each.
  CHECK(score_of(0, 1) > score_of(0, 2));
  CHECK(score_of(2, 3) > score_of(1, 3));
}

TEST_CASE("The tool names unusable input and fails") {
  const TemporaryFolder folder;
  const auto check_fails = [&](const std::string& arguments, const char* reason) {
    const CommandResult run = run_tool(arguments);
    CHECK(run.exit_code != 0);
    CHECK_THAT(run.output, Contains(reason));
  };
  const std::string at = folder.path().string();
  check_fails("train -o " + at + "/v /nowhere", "/nowhere does not exist");
  check_fails("train -o " + at + "/v " + at, "holds no image");
  folder.write("broken.png", "no image");
  check_fails("train -o " + at + "/v " + at, "broken.png: neither a PNG nor a JPEG file");
  check_fails("train -k 1 -o " + at + "/v " + at + "/broken.png", "branching = 1 is outside");
  check_fails("", "subcommand is required");
}

}  // namespace
}  // namespace km
