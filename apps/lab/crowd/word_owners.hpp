#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/place_recognition/bag_of_words.hpp"

namespace km {

/// The robot of `robots` that owns `word`, by rendezvous hashing (Thaler and Ravishankar, "Using
/// Name-Based Mappings to Increase Hit Rates", IEEE/ACM ToN 1998): the robot with the largest hash
/// of word and robot. The order of `robots` does not matter. All robots that know the same robots
/// agree without a message. When a robot leaves, only its words get new owners; when one joins, it
/// takes about 1/N of the words of each. Linear in the number of robots. Precondition: `robots` is
/// not empty.
[[nodiscard]] RobotId owner_of(std::uint32_t word, std::span<const RobotId> robots);

/// The owners of the `words` heaviest words of an image, ascending, each robot once. Two images of
/// one place share some of their heaviest words, so that their bags meet at the owner of such a
/// word. Words of equal weight count in ascending order. Empty if `robots` is.
///
/// Cieslewski and Scaramuzza, "Efficient Decentralized Visual Place Recognition Using a Distributed
/// Inverted Index", RA-L 2017, preassign all words and split each query among the owners of its
/// words. Here an owner gets all of a query, and few owners get it: the number of messages does not
/// grow with the team.
[[nodiscard]] std::vector<RobotId> owners_of(const BowVector& image, std::size_t words,
                                             std::span<const RobotId> robots);

}  // namespace km
