// Layout of the error state, and what the filter refuses.
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "filter_fixture.hpp"
#include "message_of.hpp"
#include "viwo/filter/filter.hpp"

namespace viwo {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using namespace testing;

std::string filter_refusal(const FilterOptions& options, const std::vector<BlockSpec>& blocks,
                           const std::vector<RoomSpec>& rooms = {}) {
  return error_of<std::exception>([&] { const Filter filter(options, blocks, rooms); });
}

TEST(Filter, LaysOutInertialStateClonesAndBlocks) {
  const Filter filter = make_filter();
  EXPECT_EQ(filter.size(), kSize);
  const StateBlocks& blocks = filter.blocks();
  EXPECT_EQ(blocks.view(kArmMountId).column(), kArmMount);
  EXPECT_EQ(blocks.view(kArmNumbersId).column(), kArmNumbers);
  EXPECT_EQ(blocks.view(kBaseMountId).column(), kBaseMount);
  EXPECT_EQ(blocks.view(kBaseClockId).column(), kBaseClock);
  EXPECT_EQ(blocks.view(kBaseNumbersId).column(), kBaseNumbers);
  VectorXd sigma = VectorXd::Zero(kSize);
  sigma.segment<6>(kArmMount) = kArmSigma;
  sigma.segment<8>(kArmNumbers) = VectorXd::Map(kArmNumbersSigma.data(), 8);
  sigma.segment<6>(kBaseMount) = kBaseSigma;
  sigma[kBaseClock] = kClockSigma;
  sigma.segment<3>(kBaseNumbers) = VectorXd::Map(kBaseNumbersSigma.data(), 3);
  const MatrixXd expected = sigma.cwiseAbs2().asDiagonal();
  EXPECT_EQ(filter.covariance(), expected);
  EXPECT_EQ(filter.held().first(), kBaseMount) << "what is watched stands at the end";
  EXPECT_EQ(filter.held().count(), kSize - kBaseMount);
  EXPECT_FALSE(filter.initialized());
}

TEST(Filter, ShowsUpdatesItsStateAndNothingElse) {
  Random random(10);
  Filter filter = running_filter(random, 2);
  const FilterView view = filter.view();
  EXPECT_EQ(view.P(), filter.covariance());
  EXPECT_EQ(view.size, kSize);
  EXPECT_EQ(view.clones.data(), filter.clones().data());
  ASSERT_EQ(view.blocks.size(), 5u);
  EXPECT_EQ(view.block(kBaseNumbersId).numbers()[2], 0.3);
  EXPECT_EQ(view.block(kBaseMountId).column(), kBaseMount);
  EXPECT_EQ(view.gravity_m_per_s2, filter.options().gravity_m_per_s2);
}

TEST(Filter, GivesNoColumnsToWhatIsHeld) {
  std::vector<BlockSpec> blocks = fixture_blocks();
  for (const std::size_t held : {0u, 2u, 3u}) {
    for (BlockEntry& entry : blocks[held].entries) entry.sigma = 0.;
  }
  const Filter filter(kOptions, blocks);
  EXPECT_EQ(filter.size(), kSize - 13);
  EXPECT_EQ(filter.blocks().view(kArmMountId).column(), -1);
  EXPECT_EQ(filter.blocks().view(kArmNumbersId).column(), kArmMount);
  EXPECT_EQ(filter.blocks().view(kBaseMountId).column(), -1);
  EXPECT_EQ(filter.blocks().view(kBaseClockId).column(), -1);
  EXPECT_EQ(filter.blocks().view(kBaseNumbersId).column(), kArmMount + 8);
}

TEST(Filter, RefusesBlocksRoomsAndSizesThatMakeNoSense) {
  EXPECT_EQ(filter_refusal(kOptions, fixture_blocks()), "");
  for (const double value : {-1e-9, kNaN, std::numeric_limits<double>::infinity()}) {
    std::vector<BlockSpec> blocks = fixture_blocks();
    blocks[0].entries[5].sigma = value;
    EXPECT_EQ(filter_refusal(kOptions, blocks),
              "block 'arm.mount': a sigma of 'arm.p_z' is negative or not finite");
    blocks = fixture_blocks();
    blocks[4].entries[1].process_sigma = value;
    EXPECT_EQ(filter_refusal(kOptions, blocks),
              "block 'base.numbers': a sigma of 'n_2' is negative or not finite");
  }
  EXPECT_EQ(filter_refusal(kOptions, {}, {{"points", 3, 10}}),
            "room 'points': its blocks have 10 entries, not 1 to 9");
  for (const int clones : {-1, 0, 1, 101}) {
    FilterOptions options;
    options.clones = clones;
    EXPECT_EQ(filter_refusal(options, fixture_blocks()),
              "the number of clones must be within 2 .. 100");
  }
}

TEST(Filter, FactorThatIsNotFiniteIsRejectedAndChangesNothing) {
  Random random(9);
  Filter filter = running_filter(random, 2);
  const MatrixXd P = filter.covariance();
  const Vector3d p = filter.imu().p_IinG;
  for (int part = 0; part < 3; ++part) {
    for (const double gate : {0., 0.01}) {
      ResidualFactor factor = random_factor(random);
      factor.gate_probability = gate;
      (part == 0 ? factor.H(1, 2) : part == 1 ? factor.residual[3] : factor.R(2, 2)) = kNaN;
      EXPECT_EQ(filter.apply(factor), FactorResult::kRejected) << part;
    }
  }
  EXPECT_EQ(filter.covariance(), P);
  EXPECT_EQ(filter.imu().p_IinG, p);
}

}  // namespace
}  // namespace viwo
