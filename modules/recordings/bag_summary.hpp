#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/image_size.hpp"
#include "modules/recordings/bag_reader.hpp"
#include "modules/recordings/stamp_statistics.hpp"

namespace km {

/// The first image of a topic.
struct TopicImage {
  ImageSize size;
  std::string encoding;    ///< "mono8", "jpeg", ...
  std::string frame = {};  ///< Frame in the header.
};

/// nullopt if the message is not an image of its channel's type.
[[nodiscard]] std::optional<TopicImage> topic_image(const BagChannel& channel,
                                                    const BagMessage& message);

/// A topic of a recording.
struct TopicSummary {
  std::string topic;
  std::string type;
  std::string encoding;
  bool has_sensor_stamps = false;  ///< Stamps are from message headers; else they are log times.
  std::vector<Stamp> stamps;       ///< Stamps in the order of the recording [ns].
  bool is_image = false;
  std::optional<TopicImage> image;
  std::size_t undecoded = 0;  ///< Number of messages that are not of their type, without a stamp.
};

/// Two topics of images with about the same rate.
struct TopicPair {
  std::string first, second;
  StampAgreement agreement;
};

/// Summarises all remaining messages. Returns topics in the order of the channels; a topic may have
/// several channels. Takes 8 bytes for each message.
[[nodiscard]] std::vector<TopicSummary> summarise_topics(BagReader& reader);

/// All pairs of image topics whose rates differ by at most 5 %. Two stamps belong together if they
/// are less than half an interval apart.
[[nodiscard]] std::vector<TopicPair> pairs_of_images(const std::vector<TopicSummary>& topics);

}  // namespace km
