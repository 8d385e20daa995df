#include "modules/sensors/dataset_reader.hpp"

#include <array>

#include "modules/core/io/text_table.hpp"

namespace km {

void RecordingPart::check(const std::string& recording) const {
  if (!(from_s < to_s))
    throw std::invalid_argument(recording + ": the window from " + fixed(from_s, 3) + " s to " +
                                fixed(to_s, 3) + " s is empty");
}

const char* to_string(ReaderFault fault) {
  // In the order of ReaderFault.
  static constexpr std::array<const char*, 29> kNames = {
      "malformed rows",
      "inertial samples with NaN or infinity",
      "inertial samples beyond what sensors measure",
      "malformed inertial samples",
      "inertial samples out of order",
      "repeated inertial samples",
      "inertial samples with stamps that jump",
      "gaps between inertial samples",
      "samples of the gyroscope without an acceleration",
      "stamps out of order",
      "repeated stamps",
      "stamps that jump",
      "left images without a right one",
      "right images without a left one",
      "images without a time",
      "missing images",
      "unreadable images",
      "images of the wrong size",
      "frames without inertial samples",
      "images of the wrong format",
      "depth or label images without a frame",
      "label images with colours that are not in the palette",
      "messages that are not of their type",
      "damaged pieces of the recording",
      "frames without a pose of the external odometry",
      "messages lost on the way",
      "images missing between others",
      "pauses of a camera",
      "clocks set back",
  };
  return kNames.at(static_cast<std::size_t>(fault));
}

ReaderFault fault_of_samples(ReaderFault fault) {
  using enum ReaderFault;
  if (fault == kMalformedRow || fault == kMalformedMessage) return kMalformedSample;
  if (fault == kUnorderedStamp) return kUnorderedSample;
  if (fault == kRepeatedStamp) return kRepeatedSample;
  return fault == kJumpingStamp ? kJumpingSample : fault;
}

}  // namespace km
