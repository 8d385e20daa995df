#include <catch2/catch.hpp>

#include "modules/place_recognition/bow_database.hpp"
#include "modules/place_recognition/vocabulary.hpp"
#include "modules/place_recognition/vocabulary_training.hpp"
#include "test/modules/place_recognition/synthetic_orb.hpp"

namespace km {
namespace {

constexpr std::size_t kDescriptors = 1000;  // per image
constexpr int kTrainingFlips = 5;
constexpr int kImageFlips = 8;

TEST_CASE("Bag of words, k = 10, L = 5", "[place_recognition][!benchmark]") {
  SyntheticOrb world(5, 1);
  const auto training = world.images(300, kDescriptors, kTrainingFlips);
  const VocabularyData data = train_vocabulary(training, {.branching = 10, .depth = 5});
  const Vocabulary vocabulary(data);
  WARN(vocabulary.size() << " words from " << training.size() * kDescriptors << " descriptors");

  BENCHMARK("train, 300000 descriptors") {
    return train_vocabulary(training, {.branching = 10, .depth = 5});
  };

  // A different image every time: its descriptors and nodes are not in the cache already.
  const auto fresh = world.images(1000, kDescriptors, kImageFlips);
  std::size_t next = 0;
  BENCHMARK("transform, 1000 descriptors, another image each time") {
    return vocabulary.transform(fresh[next++ % fresh.size()]);
  };
  BENCHMARK("words only, 1000 descriptors") {
    return vocabulary.words(fresh[next++ % fresh.size()]);
  };

  std::vector<BowVector> vectors;
  for (std::size_t i = 0; i < 10000; ++i)
    vectors.push_back(vocabulary.transform(world.image(kDescriptors, kImageFlips)));
  std::size_t words = 0;
  for (const BowVector& vector : vectors) words += vector.words.size();
  WARN(words / vectors.size() << " words an image");

  BowDatabase database(vocabulary.size());
  for (const std::size_t size : {1000U, 5000U, 10000U}) {
    while (database.size() < size) database.add(vectors[database.size()]);
    BENCHMARK("query, 10 best of " + std::to_string(size) + " images") {
      return database.query(vectors[next++ * 7 % vectors.size()], {.max_matches = 10});
    };
  }
  BENCHMARK_ADVANCED("add, to 5000 images")(Catch::Benchmark::Chronometer meter) {
    BowDatabase half(vocabulary.size());
    for (std::size_t i = 0; i < 5000; ++i) half.add(vectors[i]);
    meter.measure(
        [&](int i) { return half.add(vectors[5000 + static_cast<std::size_t>(i) % 5000]); });
  };
}

}  // namespace
}  // namespace km
