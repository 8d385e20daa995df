#include <catch2/catch.hpp>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>

#include "modules/place_recognition/vocabulary_file.hpp"
#include "modules/place_recognition/vocabulary_training.hpp"
#include "test/modules/place_recognition/synthetic_orb.hpp"

using Catch::Matchers::Contains;

namespace km {
namespace {

VocabularyData small_vocabulary() {
  SyntheticOrb world(2, 1);
  return train_vocabulary(world.images(5, 40, 5), {.branching = 4, .depth = 2});
}

void overwrite(std::string& bytes, std::size_t offset, std::uint32_t value) {
  std::memcpy(bytes.data() + offset, &value, sizeof(value));
}

// A path in the temporary folder that no other process uses; removed at the end.
class TemporaryFile {
 public:
  TemporaryFile()
      : path_(std::filesystem::temp_directory_path() /
              ("km_vocabulary_" + std::to_string(std::random_device{}()) + ".kmvoc")) {}
  ~TemporaryFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

TEST_CASE("A vocabulary survives its file, identity and scores included", "[place_recognition]") {
  const VocabularyData data = small_vocabulary();
  const Vocabulary before(data);
  const TemporaryFile file;
  save_vocabulary(data, file.path());
  const Vocabulary after = load_vocabulary(file.path());
  CHECK(after.data() == data);
  CHECK(after.id() == before.id());
  SyntheticOrb world(2, 1);
  const auto image = world.image(100, 8);
  CHECK(after.transform(image) == before.transform(image));
}

TEST_CASE("Vocabularies that differ in anything have different ids", "[place_recognition]") {
  const VocabularyData data = small_vocabulary();
  VocabularyData other = data;
  other.idf[3] += 0.5F;
  CHECK(fingerprint(other) != fingerprint(data));
  other = data;
  other.centers[2][31] ^= 1U;
  CHECK(fingerprint(other) != fingerprint(data));
  other = data;
  ++other.depth;
  CHECK(fingerprint(other) != fingerprint(data));
  CHECK(fingerprint_text(0x0123456789ABCDEF) == "0123456789abcdef");
}

TEST_CASE("A truncated or overlong vocabulary is refused at every length", "[place_recognition]") {
  const std::string bytes = serialize(small_vocabulary());
  for (std::size_t size = 0; size < bytes.size(); ++size)
    CHECK_THROWS_AS(deserialize(bytes.substr(0, size), "cut"), std::runtime_error);
  CHECK_THROWS_WITH(deserialize(bytes.substr(0, 39), "cut"),
                    Contains("vocabulary cut, offset 39: ends inside the header"));
  CHECK_THROWS_WITH(deserialize(bytes + 'x', "long"),
                    Contains("the header promises " + std::to_string(bytes.size())));
}

TEST_CASE("A vocabulary with any byte changed is refused", "[place_recognition]") {
  const std::string bytes = serialize(small_vocabulary());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (28 <= i && i < 32) continue;  // reserved
    CAPTURE(i);
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x04);
    CHECK_THROWS_AS(deserialize(damaged, "damaged"), std::runtime_error);
  }
}

TEST_CASE("A refusal names the file, the offset and what is wrong there", "[place_recognition]") {
  const std::string good = serialize(small_vocabulary());
  std::string bytes = good;
  bytes[0] = 'X';
  CHECK_THROWS_WITH(deserialize(bytes, "a/b"), Contains("vocabulary a/b, offset 0: not a"));
  bytes = good;
  overwrite(bytes, 8, 7);
  CHECK_THROWS_WITH(deserialize(bytes, "b"), Contains("offset 8: format version 7, known is 1"));
  bytes = good;
  overwrite(bytes, 12, 256);
  CHECK_THROWS_WITH(deserialize(bytes, "b"), Contains("offset 12: branching 256"));
  bytes = good;
  overwrite(bytes, 16, 0xFFFFFFFF);
  CHECK_THROWS_WITH(deserialize(bytes, "b"), Contains("offset 16: depth 4294967295"));
  bytes = good;
  overwrite(bytes, 20, 0xFFFFFFFF);  // would be 137 GB: refused before anything is allocated
  CHECK_THROWS_WITH(deserialize(bytes, "b"), Contains("offset 20: 4294967295 nodes"));
  bytes = good;
  overwrite(bytes, 20, 1U << 26U);
  CHECK_THROWS_WITH(deserialize(bytes, "b"), Contains("but the header promises"));
  bytes = good;
  bytes.back() = static_cast<char>(bytes.back() ^ 1);
  CHECK_THROWS_WITH(deserialize(bytes, "b"), Contains("offset 32: the checksum"));
}

TEST_CASE("A malformed tree is refused although its checksum fits", "[place_recognition]") {
  VocabularyData data = small_vocabulary();
  data.children[0] = 5;
  CHECK_THROWS_WITH(deserialize(serialize(data), "forged"),
                    Contains("offset 40: node 0 has 5 children, branching is 4"));
}

TEST_CASE("A file that is not there is named", "[place_recognition]") {
  CHECK_THROWS_WITH(load_vocabulary("/nowhere/at.all"), Contains("/nowhere/at.all"));
  CHECK_THROWS_WITH(load_vocabulary("config"), Contains("cannot be read"));  // a folder
  CHECK_THROWS_WITH(save_vocabulary(small_vocabulary(), "/nowhere/at.all"),
                    Contains("cannot be written"));
}

}  // namespace
}  // namespace km
