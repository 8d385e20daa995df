#include <array>
#include <span>

#include "apps/lab/simulation/world/objects.hpp"

namespace km {
namespace {

using Eigen::Vector3f;
using enum Recipe;
using SurfaceClass::kFence, SurfaceClass::kObject, SurfaceClass::kPerson, SurfaceClass::kPole,
    SurfaceClass::kTent, SurfaceClass::kTerrain, SurfaceClass::kUnknown, SurfaceClass::kVegetation,
    SurfaceClass::kVehicle;

struct Vec {
  double x = 0.0, y = 0.0, z = 0.0;

  [[nodiscard]] Vector3f vector() const { return Eigen::Vector3d(x, y, z).cast<float>(); }
};

struct PaintRow {
  Recipe recipe;
  Vec rgb;
  double specular = 0.0;
  int drawn = -1;  // the colour is multiplied by this one of the object's two drawn colours
  double scale = 1.0;
  SurfaceClass label = kUnknown;  // kUnknown: that of the object
};

enum Paint : std::uint8_t {
  kIron,
  kSteel,
  kWhite,
  kBlack,
  kRed,
  kGlass,
  kTimber,
  kStone,
  kFirst,   // painted, in the first drawn colour
  kSecond,  // in the second one
  kGloss,   // car paint
  kCoat,    // cloth
  kTrousers,
  kOlive,  // canvas
  kOliveMetal,
  kRibbed,  // corrugated, in the first colour
  kSkin,
  kPrint,    // posters
  kLetters,  // large writing on the first colour
  kEarth,
  kFoliage,
  kLogs,
};

// By Paint.
constexpr PaintRow kPaints[] = {
    {kPlain, {.06, .065, .07}, .05},
    {kPlain, {.4, .41, .42}, .1},
    {kPlain, {.8, .8, .78}, .1},
    {kPlain, {.03, .03, .03}},
    {kPlain, {.5, .04, .03}},
    {kPlain, {.026, .028, .03}, .4},
    {kWoodPlanks, {.85, .75, .6}},
    {kConcrete, {.95, .93, .88}},
    {kPaintedMetal, {1, 1, 1}, 0, 0},
    {kPaintedMetal, {1, 1, 1}, 0, 1},
    {kPlain, {1.1, 1.1, 1.1}, .14, 0},
    {kCanvas, {1, 1, 1}, 0, 0, .3},
    {kCanvas, {1, 1, 1}, 0, 1, .3},
    {kCanvas, {.24, .24, .14}},
    {kPaintedMetal, {.18, .19, .11}},
    {kCorrugatedMetal, {1, 1, 1}, 0, 0},
    {kPlain, {.45, .3, .22}},
    {kPosters, {1, 1, 1}},
    {kNewsprint, {1, 1, 1}, 0, 0, 9.0},
    {kSoil, {1, 1, 1}, 0, -1, 1.0, kTerrain},
    {kLeaves, {1.1, 1.1, .9}, 0, -1, 1.0, kVegetation},
    {kBark, {1, 1, 1}},
};

constexpr Vec kColors[] = {{.2, .22, .12}, {.42, .1, .06}, {.06, .15, .3},  {.55, .53, .48},
                           {.5, .42, .26}, {.1, .24, .16}, {.05, .05, .06}, {.65, .63, .6},
                           {.3, .3, .32},  {.6, .42, .08}, {.25, .16, .1},  {.2, .35, .5}};

enum Shape : std::uint8_t {
  kBox,    // from the lower corner to the upper one
  kTube,   // from the middle of one end to that of the other; radii of both
  kBall,   // half axes `to` around `from`
  kBunch,  // leaves within it
};

struct Part {
  Shape shape;
  Paint paint;
  Vec from, to;
  double radius = 0.0;
  double end_radius = -1.0;  // -1: equal
  int count = 1;             // copies, each `step` beside the one before
  Vec step = {};
};

constexpr Part kStreetLampParts[] = {{kTube, kIron, {0, 0, -.1}, {0, 0, .9}, .14, .085},
                                     {kTube, kIron, {0, 0, .9}, {0, 0, 5.5}, .07, .05},
                                     {kTube, kIron, {0, 0, 5.4}, {0, -1.3, 5.75}, .04, .035},
                                     {kBall, kIron, {0, -1.5, 5.77}, {.14, .36, .09}},
                                     {kBall, kWhite, {0, -1.52, 5.72}, {.1, .27, .07}}};
constexpr Part kRoundSignParts[] = {{kTube, kSteel, {0, 0, -.1}, {0, 0, 2.9}, .035},
                                    {kTube, kRed, {0, -.04, 2.5}, {0, -.06, 2.5}, .33},
                                    {kTube, kWhite, {0, -.06, 2.5}, {0, -.064, 2.5}, .26},
                                    {kBox, kBlack, {-.16, -.075, 2.41}, {-.04, -.06, 2.6}},
                                    {kBox, kBlack, {.03, -.075, 2.41}, {.16, -.06, 2.6}},
                                    {kBox, kWhite, {-.26, -.06, 1.82}, {.26, -.04, 2.02}},
                                    {kBox, kBlack, {-.2, -.064, 1.89}, {.16, -.06, 1.94}}};
constexpr Part kNameSignParts[] = {{kTube, kSteel, {0, 0, -.1}, {0, 0, 2.8}, .035},
                                   {kBox, kLetters, {-.6, -.1, 2.4}, {.6, -.03, 2.75}}};
constexpr Part kTrafficLightParts[] = {
    {kTube, kIron, {0, 0, -.1}, {0, 0, 3.3}, .06},
    {kBox, kIron, {-.15, -.2, 2.35}, {.15, .02, 3.25}},
    {kTube, kSteel, {0, -.2, 2.5}, {0, -.21, 2.5}, .1, -1, 3, {0, 0, .3}},
    {kTube, kRed, {0, -.2, 3.1}, {0, -.215, 3.1}, .1},
    {kBox, kIron, {-.12, -.34, 2.6}, {.12, -.2, 2.63}, 0, -1, 3, {0, 0, .3}}};
constexpr Part kBenchParts[] = {
    {kBox, kIron, {-.75, -.22, -.05}, {-.7, -.17, .42}, 0, -1, 2, {1.45, 0, 0}},
    {kBox, kIron, {-.75, .17, -.05}, {-.7, .22, .85}, 0, -1, 2, {1.45, 0, 0}},
    {kBox, kTimber, {-.9, -.24, .42}, {.9, -.15, .455}, 0, -1, 4, {0, .11, 0}},
    {kBox, kTimber, {-.9, .13, .52}, {.9, .17, .61}, 0, -1, 3, {0, 0, .12}}};
constexpr Part kBinParts[] = {{kBox, kFirst, {-.26, -.3, .06}, {.26, .3, .95}},
                              {kBox, kFirst, {-.29, -.36, .95}, {.29, .32, 1.03}},
                              {kTube, kIron, {-.28, .26, .1}, {.28, .26, .1}, .1}};
constexpr Part kHydrantParts[] = {{kTube, kRed, {0, 0, -.05}, {0, 0, .06}, .16},
                                  {kTube, kRed, {0, 0, .06}, {0, 0, .58}, .11},
                                  {kBall, kRed, {0, 0, .58}, {.15, .15, .2}},
                                  {kTube, kRed, {-.22, 0, .42}, {.22, 0, .42}, .06}};
constexpr Part kAdvertisingColumnParts[] = {{kTube, kPrint, {0, 0, .3}, {0, 0, 2.9}, .637},
                                            {kTube, kFirst, {0, 0, -.1}, {0, 0, .3}, .7, .68},
                                            {kTube, kFirst, {0, 0, 2.9}, {0, 0, 3.05}, .76},
                                            {kTube, kFirst, {0, 0, 3.05}, {0, 0, 3.7}, .74, .05}};
constexpr Part kPlanterParts[] = {
    {kBox, kStone, {-.8, -.35, -.05}, {.8, .35, .5}},
    {kBox, kStone, {-.84, -.39, .5}, {.84, .39, .56}},
    {kBox, kEarth, {-.75, -.3, .5}, {.75, .3, .57}},
    {kBunch, kFoliage, {-.5, 0, .78}, {.32, .27, .32}, 0, -1, 3, {.5, 0, 0}}};
constexpr Part kMonumentParts[] = {{kTube, kStone, {0, 0, -.1}, {0, 0, .6}, 2.6, 2.5},
                                   {kTube, kGlass, {0, 0, .6}, {0, 0, .61}, 2.3},
                                   {kTube, kStone, {0, 0, .6}, {0, 0, 1}, .8, .6},
                                   {kTube, kStone, {0, 0, 1}, {0, 0, 2.4}, .4, .3},
                                   {kTube, kStone, {0, 0, 2.4}, {0, 0, 2.7}, .6},
                                   {kTube, kStone, {0, 0, 2.7}, {0, 0, 4}, .3, .2},
                                   {kBall, kStone, {0, 0, 4.2}, {.25, .25, .3}}};
constexpr Part kNoticeBoardParts[] = {
    {kBox, kTimber, {-.9, 0, -.3}, {-.8, .1, 2.1}, 0, -1, 2, {1.7, 0, 0}},
    {kBox, kLetters, {-1.1, -.1, .95}, {1.1, 0, 2}}};
constexpr Part kStandingPersonParts[] = {
    {kTube, kTrousers, {-.1, 0, .9}, {-.1, 0, .09}, .095, .05, 2, {.2, 0, 0}},
    {kBall, kBlack, {-.1, -.06, .05}, {.05, .14, .05}, 0, -1, 2, {.2, 0, 0}},
    {kTube, kCoat, {-.2, 0, 1.42}, {-.26, 0, 1.13}, .07, .05},
    {kTube, kCoat, {.2, 0, 1.42}, {.26, 0, 1.13}, .07, .05},
    {kTube, kCoat, {-.26, 0, 1.13}, {-.24, -.08, .9}, .05, .036},
    {kTube, kCoat, {.26, 0, 1.13}, {.24, -.08, .9}, .05, .036},
    {kBall, kSkin, {-.24, -.08, .88}, {.04, .045, .06}, 0, -1, 2, {.48, 0, 0}},
    {kBall, kCoat, {0, 0, 1.2}, {.2, .13, .32}},
    {kBall, kTrousers, {0, 0, .95}, {.17, .125, .17}},
    {kTube, kSkin, {0, 0, 1.44}, {0, 0, 1.58}, .055},
    {kBall, kSkin, {0, -.01, 1.65}, {.078, .098, .115}},
    {kBall, kBlack, {0, .02, 1.69}, {.086, .1, .095}}};
constexpr Part kStridingPersonParts[] = {
    {kTube, kTrousers, {-.095, 0, .9}, {-.1, -.1, .48}, .095, .065},
    {kTube, kTrousers, {-.1, -.1, .48}, {-.1, -.2, .09}, .067, .05},
    {kTube, kTrousers, {.095, 0, .9}, {.1, .08, .48}, .095, .065},
    {kTube, kTrousers, {.1, .08, .48}, {.1, .2, .09}, .067, .05},
    {kBall, kBlack, {-.1, -.26, .05}, {.05, .14, .05}, 0, -1, 2, {.2, .4, 0}},
    {kTube, kCoat, {-.2, 0, 1.42}, {-.26, .08, 1.13}, .07, .05},
    {kTube, kCoat, {.2, 0, 1.42}, {.26, -.08, 1.13}, .07, .05},
    {kTube, kCoat, {-.26, .08, 1.13}, {-.24, .12, .9}, .05, .036},
    {kTube, kCoat, {.26, -.08, 1.13}, {.24, -.28, .9}, .05, .036},
    {kBall, kCoat, {0, 0, 1.2}, {.2, .13, .32}},
    {kTube, kCoat, {0, 0, .72}, {0, 0, 1}, .21, .17},
    {kTube, kSkin, {0, 0, 1.44}, {0, 0, 1.58}, .055},
    {kBall, kSkin, {0, -.01, 1.65}, {.078, .098, .115}},
    {kBall, kBlack, {0, .02, 1.69}, {.086, .1, .095}},
    {kBox, kTrousers, {-.15, .1, 1}, {.15, .28, 1.42}}};
constexpr Part kRailingParts[] = {
    {kBox, kStone, {0, -.12, -.1}, {2.4, .12, .3}},
    {kBox, kIron, {0, -.02, .42}, {2.4, .02, .46}, 0, -1, 2, {0, 0, .63}},
    {kBox, kIron, {.06, -.011, .3}, {.082, .011, 1.2}, 0, -1, 17, {.14, 0, 0}},
    {kBox, kIron, {0, -.04, .3}, {.08, .04, 1.3}}};
constexpr Part kPlankFenceParts[] = {
    {kBox, kTimber, {.008, -.02, .06}, {.152, 0, 1.8}, 0, -1, 15, {.16, 0, 0}},
    {kBox, kTimber, {0, 0, .35}, {2.4, .05, .44}, 0, -1, 2, {0, 0, 1.05}},
    {kBox, kTimber, {.2, .04, -.2}, {.29, .13, 1.8}}};
constexpr Part kWireFenceParts[] = {
    {kTube, kSteel, {.05, 0, -.3}, {.05, 0, 2.3}, .04, -1, 2, {2.5, 0, 0}},
    {kTube, kSteel, {.05, 0, 2.3}, {.05, -.25, 2.6}, .03, -1, 2, {2.5, 0, 0}},
    {kBox, kSteel, {0, -.006, .1}, {5, .006, .112}, 0, -1, 22, {0, 0, .1}},
    {kBox, kSteel, {.1, -.006, .05}, {.112, .006, 2.3}, 0, -1, 49, {.1, 0, 0}},
    {kBox, kSteel, {0, -.09, 2.4}, {5, -.08, 2.41}, 0, -1, 3, {0, -.075, .09}}};
constexpr Part kCratesParts[] = {
    {kBox, kTimber, {-1.55, -.38, -.05}, {-.6, .38, .84}, 0, -1, 3, {1.05, .04, 0}},
    {kBox, kOliveMetal, {-1, -.3, .84}, {-.1, .42, 1.42}},
    {kBox, kTimber, {-1.57, -.42, -.05}, {-1.49, -.34, .85}, 0, -1, 3, {1.05, .04, 0}},
    {kBox, kTimber, {-.66, -.42, -.05}, {-.58, -.34, .85}, 0, -1, 3, {1.05, .04, 0}},
    {kBox, kTimber, {-1.55, -.4, .68}, {-.6, -.37, .76}, 0, -1, 3, {1.05, .04, 0}}};
constexpr Part kBarrelsParts[] = {
    {kTube, kFirst, {-.66, 0, -.1}, {-.66, 0, .88}, .29, -1, 2, {.66, .02, 0}},
    {kTube, kFirst, {-.66, 0, .28}, {-.66, 0, .32}, .305, -1, 2, {.66, .02, 0}},
    {kTube, kFirst, {-.66, 0, .57}, {-.66, 0, .61}, .305, -1, 2, {.66, .02, 0}},
    {kTube, kSecond, {.66, .05, -.1}, {.66, .05, .88}, .29, -1, 2, {-1, .6, 0}},
    {kTube, kSecond, {.66, .05, .43}, {.66, .05, .47}, .305, -1, 2, {-1, .6, 0}}};
constexpr Part kGeneratorParts[] = {
    {kBox, kFirst, {-1.3, -.55, .12}, {1.3, .55, 1.5}},
    {kBox, kBlack, {-1.35, -.5, -.2}, {1.35, .5, .12}},
    {kBox, kBlack, {-1.1, -.56, .45}, {-.2, -.54, .5}, 0, -1, 8, {0, 0, .1}},
    {kBox, kLetters, {.2, -.565, .7}, {1, -.55, 1.2}},
    {kTube, kBlack, {.9, .2, 1.5}, {.9, .2, 1.95}, .06}};
constexpr Part kWaterTankParts[] = {
    {kTube, kFirst, {-1.5, 0, 1.35}, {1.5, 0, 1.35}, .75},
    {kTube, kBlack, {-1.23, 0, 1.35}, {-1.17, 0, 1.35}, .77, -1, 3, {1.2, 0, 0}},
    {kBox, kBlack, {-1.16, -.6, -.3}, {-1.04, -.5, 1}, 0, -1, 2, {2.2, 0, 0}},
    {kBox, kBlack, {-1.16, .5, -.3}, {-1.04, .6, 1}, 0, -1, 2, {2.2, 0, 0}},
    {kTube, kBlack, {0, 0, 2.05}, {0, 0, 2.2}, .25}};
constexpr Part kLogPileParts[] = {
    {kTube, kLogs, {-1.3, -.64, .14}, {1.3, -.64, .14}, .16, .15, 6, {.02, .32, 0}},
    {kTube, kLogs, {-1.35, -.48, .42}, {1.25, -.48, .42}, .15, .16, 5, {.03, .32, 0}},
    {kTube, kLogs, {-1.2, -.32, .69}, {1.4, -.32, .69}, .16, .14, 4, {-.03, .32, 0}},
    {kTube, kLogs, {-1.3, -.16, .97}, {1.3, -.16, .97}, .15, .15, 3, {.02, .32, 0}}};
constexpr Part kSandbagsParts[] = {
    {kBall, kOlive, {-1.5, 0, .04}, {.28, .19, .105}, 0, -1, 6, {.52, .01, 0}},
    {kBall, kOlive, {-1.25, .02, .2}, {.28, .19, .105}, 0, -1, 6, {.52, -.01, 0}},
    {kBall, kOlive, {-1.5, 0, .36}, {.28, .19, .105}, 0, -1, 6, {.52, 0, 0}},
    {kBall, kOlive, {-1.25, -.02, .52}, {.28, .19, .105}, 0, -1, 6, {.52, .01, 0}},
    {kBall, kOlive, {-1.5, 0, .68}, {.28, .19, .105}, 0, -1, 6, {.52, 0, 0}}};
constexpr Part kBarrierParts[] = {{kBox, kStone, {-1.5, -.3, -.2}, {1.5, .3, .1}},
                                  {kBox, kStone, {-1.5, -.17, .1}, {1.5, .17, .35}},
                                  {kBox, kStone, {-1.5, -.09, .35}, {1.5, .09, .82}}};
constexpr Part kWatchTowerParts[] = {
    {kBox, kTimber, {-1.29, -1.29, -.4}, {-1.11, -1.11, 6}, 0, -1, 2, {2.4, 0, 0}},
    {kBox, kTimber, {-1.29, 1.11, -.4}, {-1.11, 1.29, 6}, 0, -1, 2, {2.4, 0, 0}},
    {kTube, kTimber, {-1.2, -1.2, .3}, {-1.2, 1.2, 3.4}, .05, -1, 2, {2.4, 0, 0}},
    {kTube, kTimber, {-1.2, 1.2, .3}, {1.2, 1.2, 3.4}, .05},
    {kBox, kTimber, {-1.5, -1.5, 3.6}, {1.5, 1.5, 3.72}},
    {kBox, kTimber, {-1.45, -1.45, 3.9}, {1.45, -1.4, 4.1}, 0, -1, 3, {0, 0, .3}},
    {kBox, kTimber, {-1.45, 1.4, 3.9}, {1.45, 1.45, 4.1}, 0, -1, 3, {0, 0, .3}},
    {kBox, kTimber, {-1.45, -1.4, 3.9}, {-1.4, 1.4, 4.1}, 0, -1, 3, {0, 0, .3}},
    {kBox, kTimber, {1.4, -1.4, 3.9}, {1.45, 1.4, 4.1}, 0, -1, 3, {0, 0, .3}},
    {kBox, kRibbed, {-1.8, -1.8, 5.95}, {1.8, 1.8, 6.05}},
    {kBox, kTimber, {-.25, -1.62, .2}, {.25, -1.58, .24}, 0, -1, 12, {0, 0, .3}}};
constexpr Part kFloodlightParts[] = {
    {kBox, kStone, {-.3, -.3, -.3}, {.3, .3, .25}},
    {kTube, kSteel, {0, 0, .2}, {0, 0, 6.5}, .09, .06},
    {kBox, kSteel, {-.7, -.04, 6.3}, {.7, .04, 6.38}},
    {kBox, kSteel, {-.75, -.2, 6.4}, {-.25, .05, 6.8}, 0, -1, 2, {1, 0, 0}},
    {kBox, kWhite, {-.71, -.215, 6.44}, {-.29, -.2, 6.76}, 0, -1, 2, {1, 0, 0}}};
constexpr Part kContainerParts[] = {
    {kBox, kRibbed, {-2.95, -1.19, .1}, {2.95, 1.19, 2.53}},
    {kBox, kFirst, {-3.03, -1.22, -.25}, {3.03, -1.12, .14}, 0, -1, 2, {0, 2.34, 0}},
    {kBox, kFirst, {-3.03, -1.22, 2.49}, {3.03, -1.12, 2.59}, 0, -1, 2, {0, 2.34, 0}},
    {kBox, kFirst, {-3.03, -1.22, 0}, {-2.91, -1.12, 2.59}, 0, -1, 2, {5.94, 0, 0}},
    {kBox, kFirst, {-3.03, 1.12, 0}, {-2.91, 1.22, 2.59}, 0, -1, 2, {5.94, 0, 0}},
    {kBox, kFirst, {2.95, -1.1, .16}, {3, -.03, 2.45}, 0, -1, 2, {0, 1.13, 0}},
    {kTube, kSteel, {3.03, -1, .12}, {3.03, -1, 2.5}, .022, -1, 4, {0, .66, 0}},
    {kBox, kSteel, {3, -1.1, 1.05}, {3.06, -.8, 1.1}, 0, -1, 4, {0, .66, 0}},
    {kBox, kLetters, {-2.2, -1.21, 1.55}, {-.2, -1.19, 2}}};
constexpr Part kTruckParts[] = {
    {kBox, kOliveMetal, {1.9, -.8, .75}, {3.2, .8, 1.5}},
    {kBox, kOliveMetal, {.7, -1.06, .7}, {1.9, 1.06, 2.3}},
    {kBox, kGlass, {1.85, -.95, 1.55}, {1.93, .95, 2.2}},
    {kBox, kGlass, {1, -1.08, 1.5}, {1.7, 1.08, 2.15}},
    {kBox, kBlack, {-3.25, -.45, .62}, {3.1, .45, .82}},
    {kBox, kOliveMetal, {-3.3, -1.13, 1}, {.55, 1.13, 1.7}},
    {kBox, kBlack, {-3.1, -1.16, 1.02}, {-3.03, -1.13, 1.68}, 0, -1, 6, {.7, 0, 0}},
    {kBox, kBlack, {-3.1, 1.13, 1.02}, {-3.03, 1.16, 1.68}, 0, -1, 6, {.7, 0, 0}},
    {kBox, kOlive, {-3.28, -1.09, 1.68}, {.53, 1.09, 2.4}},
    {kBox, kOlive, {-3.28, -.75, 2.4}, {.53, .75, 2.8}},
    {kTube, kBlack, {2.45, -1.08, .51}, {2.45, -.78, .51}, .52, -1, 2, {0, 1.86, 0}},
    {kTube, kBlack, {-1.35, -1.08, .51}, {-1.35, -.78, .51}, .52, -1, 2, {0, 1.86, 0}},
    {kTube, kBlack, {-2.45, -1.08, .51}, {-2.45, -.78, .51}, .52, -1, 2, {0, 1.86, 0}},
    {kTube, kSteel, {2.45, -1.1, .51}, {2.45, -1.08, .51}, .3, -1, 2, {0, 2.18, 0}},
    {kTube, kSteel, {-1.35, -1.1, .51}, {-1.35, 1.1, .51}, .28, -1, 2, {-1.1, 0, 0}},
    {kTube, kWhite, {3.2, -.6, 1.2}, {3.22, -.6, 1.2}, .12, -1, 2, {0, 1.2, 0}},
    {kBox, kBlack, {3.2, -1, .62}, {3.36, 1, .84}},
    {kBox, kBlack, {3.2, -.4, .95}, {3.21, .4, 1.35}},
    {kTube, kOliveMetal, {-.2, -.9, .75}, {.6, -.9, .75}, .24, -1, 2, {0, 1.8, 0}}};
constexpr Part kJeepParts[] = {
    {kBox, kOliveMetal, {.6, -.66, .46}, {1.92, .66, 1.05}},
    {kBox, kOliveMetal, {-1.95, -.8, .45}, {.66, .8, 1.02}},
    {kBox, kGlass, {.5, -.72, 1.1}, {.56, .72, 1.72}},
    {kBox, kOlive, {-1.92, -.78, 1}, {.5, .78, 1.6}},
    {kBox, kOlive, {-1.92, -.55, 1.6}, {.5, .55, 1.8}},
    {kTube, kBlack, {1.2, -.88, .37}, {1.2, -.64, .37}, .38, -1, 2, {0, 1.52, 0}},
    {kTube, kBlack, {-1.25, -.88, .37}, {-1.25, -.64, .37}, .38, -1, 2, {0, 1.52, 0}},
    {kTube, kSteel, {-1.25, -.9, .37}, {-1.25, .9, .37}, .22, -1, 2, {2.45, 0, 0}},
    {kTube, kWhite, {1.92, -.42, .82}, {1.98, -.42, .82}, .1, -1, 2, {0, .84, 0}},
    {kBox, kBlack, {1.9, -.26, .62}, {1.965, -.22, .86}, 0, -1, 7, {0, .08, 0}},
    {kBox, kBlack, {1.95, -.75, .44}, {2.08, .75, .58}},
    {kTube, kBlack, {-1.95, .1, .98}, {-2.15, .1, .98}, .36}};
constexpr Part kHatchbackParts[] = {
    {kBox, kGloss, {-1.85, -.86, .26}, {1.85, .86, .7}},
    {kBall, kGloss, {1, 0, .7}, {.92, .84, .26}},
    {kBox, kGloss, {-1.88, -.83, .6}, {1, .83, .95}},
    {kTube, kGlass, {-.5, -.7, .85}, {-.5, .7, .85}, .61},
    {kBox, kGlass, {-1.2, -.72, .9}, {.1, .72, 1.4}},
    {kBox, kGloss, {-1.15, -.66, 1.4}, {0, .66, 1.47}},
    {kBox, kGloss, {-.5, -.74, .9}, {-.42, .74, 1.42}},
    {kTube, kBlack, {1.22, -.87, .3}, {1.22, -.65, .3}, .3, -1, 2, {0, 1.52, 0}},
    {kTube, kBlack, {-1.2, -.87, .3}, {-1.2, -.65, .3}, .3, -1, 2, {0, 1.52, 0}},
    {kTube, kSteel, {1.22, -.885, .3}, {1.22, .885, .3}, .19, -1, 2, {-2.42, 0, 0}},
    {kBox, kBlack, {1.8, -.7, .26}, {1.95, .7, .42}},
    {kBox, kBlack, {-1.96, -.74, .3}, {-1.8, .74, .46}},
    {kBall, kWhite, {1.78, -.62, .66}, {.16, .17, .09}, 0, -1, 2, {0, 1.24, 0}},
    {kBox, kRed, {-1.9, -.8, .7}, {-1.86, -.62, .9}, 0, -1, 2, {0, 1.42, 0}},
    {kBox, kWhite, {-1.98, -.26, .56}, {1.97, .26, .66}},
    {kBall, kGloss, {.4, -.95, 1}, {.09, .11, .075}, 0, -1, 2, {0, 1.9, 0}},
    {kBox, kBlack, {-.46, -.862, .3}, {-.45, .862, .95}, 0, -1, 2, {1.15, 0, 0}}};
constexpr Part kVanParts[] = {
    {kBox, kGloss, {-2.6, -.96, .28}, {2.5, .96, 1.05}},
    {kBox, kGloss, {-2.58, -.94, 1.05}, {1.35, .94, 2.1}},
    {kBox, kGloss, {-2.55, -.84, 2.1}, {1.25, .84, 2.16}},
    {kTube, kGlass, {1.1, -.85, 1.2}, {1.1, .85, 1.2}, .75},
    {kBox, kGlass, {.4, -.95, 1.25}, {1.2, .95, 1.85}},
    {kBox, kGlass, {-2.62, -.7, 1.24}, {-2.58, -.1, 1.8}, 0, -1, 2, {0, .8, 0}},
    {kTube, kBlack, {1.72, -.98, .34}, {1.72, -.76, .34}, .34, -1, 2, {0, 1.74, 0}},
    {kTube, kBlack, {-1.55, -.98, .34}, {-1.55, -.76, .34}, .34, -1, 2, {0, 1.74, 0}},
    {kTube, kSteel, {1.72, -.995, .34}, {1.72, .995, .34}, .21, -1, 2, {-3.27, 0, 0}},
    {kBox, kBlack, {2.45, -.8, .3}, {2.62, .8, .46}},
    {kBox, kWhite, {2.48, -.85, .7}, {2.53, -.55, .9}, 0, -1, 2, {0, 1.4, 0}},
    {kBox, kBlack, {2.48, -.4, .7}, {2.52, .4, .9}},
    {kBox, kRed, {-2.63, -.9, .9}, {-2.58, -.75, 1.2}, 0, -1, 2, {0, 1.65, 0}},
    {kBox, kWhite, {-2.65, -.26, .6}, {2.64, .26, .7}},
    {kBox, kBlack, {-.5, -.962, .3}, {-.49, .962, 2}, 0, -1, 3, {.85, 0, 0}},
    {kBox, kLetters, {-2.3, -.95, 1.25}, {-.7, .95, 1.75}}};

struct PropRow {
  SurfaceClass label;
  std::span<const Part> parts;
};

// By Prop.
constexpr PropRow kProps[] = {{kPole, kStreetLampParts},       {kPole, kRoundSignParts},
                              {kPole, kNameSignParts},         {kPole, kTrafficLightParts},
                              {kObject, kBenchParts},          {kObject, kBinParts},
                              {kObject, kHydrantParts},        {kObject, kAdvertisingColumnParts},
                              {kObject, kPlanterParts},        {kObject, kMonumentParts},
                              {kPole, kNoticeBoardParts},      {kPerson, kStandingPersonParts},
                              {kPerson, kStridingPersonParts}, {kFence, kRailingParts},
                              {kFence, kPlankFenceParts},      {kFence, kWireFenceParts},
                              {kObject, kCratesParts},         {kObject, kBarrelsParts},
                              {kObject, kGeneratorParts},      {kObject, kWaterTankParts},
                              {kObject, kLogPileParts},        {kObject, kSandbagsParts},
                              {kObject, kBarrierParts},        {kObject, kWatchTowerParts},
                              {kPole, kFloodlightParts},       {kObject, kContainerParts},
                              {kVehicle, kTruckParts},         {kVehicle, kJeepParts},
                              {kVehicle, kHatchbackParts},     {kVehicle, kVanParts}};

void add_part(Scene& scene, const Part& part, MaterialId material, SeededRandom& random) {
  const Vector3f from = part.from.vector(), to = part.to.vector();
  const auto radius = static_cast<float>(part.radius);
  const float end = part.end_radius < 0.0 ? radius : static_cast<float>(part.end_radius);
  switch (part.shape) {
    case kBox:
      return scene.box(from, to, material);
    case kTube:
      return scene.cylinder(from, to, radius, end, radius < 0.1F ? 8 : 18, material);
    case kBall:
      return scene.ellipsoid(from, to, 10, material);
    case kBunch:
      return scene.leaf_cluster(from, to, 90, 0.16F, material, random);
  }
}

}  // namespace

void add_prop(Scene& scene, Prop prop, SeededRandom& random) {
  const Scene::Object object(scene);
  const PropRow& row = kProps[static_cast<std::size_t>(prop)];
  const std::array<Vector3f, 2> drawn = {random.pick(kColors).vector(),
                                         random.pick(kColors).vector()};
  const float u = random.uniform(0.0F, 8.0F);
  scene.set_uv_offset({u, random.uniform(0.0F, 8.0F)});
  for (const Part& part : row.parts) {
    const PaintRow& paint = kPaints[part.paint];
    const Vector3f tint =
        paint.drawn < 0 ? Vector3f::Ones().eval() : drawn[static_cast<std::size_t>(paint.drawn)];
    const MaterialId material =
        scene.paint(paint.label == kUnknown ? row.label : paint.label, paint.recipe,
                    tint.cwiseProduct(paint.rgb.vector()), static_cast<float>(paint.scale),
                    static_cast<float>(paint.specular));
    for (int i = 0; i < part.count; ++i) {
      const auto frame = scene.at(static_cast<float>(i) * part.step.vector());
      add_part(scene, part, material, random);
    }
  }
  scene.set_uv_offset(Eigen::Vector2f::Zero());
}

void add_car(Scene& scene, SeededRandom& random) {
  add_prop(scene, random.chance(0.8) ? Prop::kHatchback : Prop::kVan, random);
}

void add_person(Scene& scene, SeededRandom& random) {
  add_prop(scene, random.chance(0.5) ? Prop::kStandingPerson : Prop::kStridingPerson, random);
}

}  // namespace km
