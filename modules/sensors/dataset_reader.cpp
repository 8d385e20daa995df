#include "modules/sensors/dataset_reader.hpp"

namespace km {

const char* to_string(ReaderFault fault) {
  switch (fault) {
    case ReaderFault::kMalformedRow:
      return "malformed rows";
    case ReaderFault::kNotFinite:
      return "inertial samples with NaN or infinity";
    case ReaderFault::kImplausible:
      return "inertial samples beyond what sensors measure";
    case ReaderFault::kUnorderedStamp:
      return "stamps out of order";
    case ReaderFault::kRepeatedStamp:
      return "repeated stamps";
    case ReaderFault::kJumpingStamp:
      return "stamps that jump";
    case ReaderFault::kLeftWithoutRight:
      return "left images without a right one";
    case ReaderFault::kRightWithoutLeft:
      return "right images without a left one";
    case ReaderFault::kImageWithoutTime:
      return "images without a time";
    case ReaderFault::kMissingImage:
      return "missing images";
    case ReaderFault::kUnreadableImage:
      return "unreadable images";
    case ReaderFault::kWrongImageSize:
      return "images of the wrong size";
    case ReaderFault::kImuGap:
      return "gaps between inertial samples";
    case ReaderFault::kPairWithoutImu:
      return "frames without inertial samples";
    case ReaderFault::kWrongImageFormat:
      return "images of the wrong format";
    case ReaderFault::kImageWithoutFrame:
      return "depth or label images without a frame";
    case ReaderFault::kUnknownColor:
      return "label images with colours that are not in the palette";
    case ReaderFault::kMalformedMessage:
      return "messages that are not of their type";
    case ReaderFault::kNoAcceleration:
      return "samples of the gyroscope without an acceleration";
    case ReaderFault::kDamagedBag:
      return "damaged pieces of the recording";
    case ReaderFault::kFrameWithoutPose:
      return "frames without a pose of the external odometry";
    case ReaderFault::kLostMessage:
      return "messages lost on the way";
    case ReaderFault::kMissingBetween:
      return "images missing between others";
    case ReaderFault::kPause:
      return "pauses of a camera";
  }
  return "unknown faults";
}

}  // namespace km
