#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/image_size.hpp"
#include "modules/recordings/bag_reader.hpp"
#include "modules/recordings/stamp_statistics.hpp"

namespace km {

/// Size and encoding of the first image of a topic.
struct TopicImage {
  ImageSize size;
  std::string encoding;  ///< "mono8", "jpeg", ...
};

/// A topic of a recording. Its stamps are those of the sensor if its messages have a header,
/// otherwise those of the recorder.
struct TopicSummary {
  std::string topic;
  std::string type;
  std::string encoding;
  bool has_sensor_stamps = false;
  std::vector<Stamp> stamps;  ///< As recorded [ns].
  bool is_image = false;
  std::optional<TopicImage> image;
  std::size_t undecoded = 0;  ///< Messages that are not of their type: they have no stamp here.
};

/// Two topics of images with one rate.
struct TopicPair {
  std::string first, second;
  StampAgreement agreement;
};

/// Reads all remaining messages. Returns topics in the order of the channels; several channels may
/// be one topic. Takes 8 bytes for each message.
[[nodiscard]] std::vector<TopicSummary> summarise_topics(BagReader& reader);

/// All pairs of image topics whose rates differ by at most 5 %. Stamps are a pair if they are less
/// than half an interval apart.
[[nodiscard]] std::vector<TopicPair> pairs_of_images(const std::vector<TopicSummary>& topics);

}  // namespace km
