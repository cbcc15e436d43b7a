// Cells of encoder samples, by hand-computed numbers.
#include <cmath>

#include <gtest/gtest.h>

#include "viwo/log/cells.hpp"

namespace viwo::log {
namespace {

std::vector<EncoderSample> samples_at(const std::vector<std::int64_t>& stamps) {
  std::vector<EncoderSample> out;
  for (const std::int64_t t_ns : stamps) {
    EncoderSample sample;
    sample.t_ns = t_ns;
    out.push_back(sample);
  }
  return out;
}

std::vector<std::pair<std::int64_t, std::int64_t>> cells_of(
    const std::vector<EncoderSample>& samples) {
  std::vector<std::pair<std::int64_t, std::int64_t>> out;
  for (const EncoderSample& sample : samples) out.emplace_back(sample.begin_ns, sample.end_ns);
  return out;
}

using Cells = std::vector<std::pair<std::int64_t, std::int64_t>>;

TEST(Cells, MeetAtTheMidPointsBetweenStamps) {
  auto samples = samples_at({100, 200, 240, 341});
  make_cells(samples, 1.);
  EXPECT_EQ(cells_of(samples), (Cells{{100, 150}, {150, 220}, {220, 290}, {290, 341}}));
}

TEST(Cells, LeaveAHoleInAGapAndReachIntoItByHalfOfTheMedianSpacing) {
  auto samples = samples_at({0, 100, 200, 1'200, 1'300});
  make_cells(samples, 500e-9);
  EXPECT_EQ(cells_of(samples),
            (Cells{{0, 50}, {50, 150}, {150, 250}, {1'150, 1'250}, {1'250, 1'300}}));
}

TEST(Cells, DoNotOverlapWhereTheMedianSpacingItselfIsAGap) {
  auto samples = samples_at({0, 1'000, 2'000, 2'600});
  make_cells(samples, 500e-9);
  EXPECT_EQ(cells_of(samples), (Cells{{0, 500}, {500, 1'500}, {1'500, 2'300}, {2'300, 2'600}}));
}

TEST(Cells, OfOneSampleAreItsStamp) {
  auto samples = samples_at({70});
  make_cells(samples, 1.);
  EXPECT_EQ(cells_of(samples), (Cells{{70, 70}}));
  std::vector<EncoderSample> none;
  make_cells(none, 1.);
  EXPECT_TRUE(none.empty());
}

std::vector<EncoderReading> readings() {
  const auto reading = [](std::int64_t t_ns, double drive, double steer) {
    EncoderReading out;
    out.t_ns = t_ns;
    out.n_drive = 1;
    out.n_steer = 1;
    out.drive[0] = drive;
    out.steer_rad[0] = steer;
    return out;
  };
  return {reading(0, 10., 0.),
          reading(10'000'000, 10.5, 0.2),
          reading(20'000'000, 10.25, 0.4),
          reading(1'000'000'000, 50., 3.1),
          reading(1'020'000'000, 51., -3.1),
          reading(1'030'000'000, 51., -3.1)};
}

TEST(CellsFromAngles, HoldTheMeanRateBetweenTwoStamps) {
  const auto cells = cells_from_angles(readings(), 0.2);
  ASSERT_EQ(cells.size(), 4U);  // none over the gap
  EXPECT_EQ(cells_of(cells), (Cells{{0, 10'000'000},
                                    {10'000'000, 20'000'000},
                                    {1'000'000'000, 1'020'000'000},
                                    {1'020'000'000, 1'030'000'000}}));
  EXPECT_EQ(cells[0].t_ns, 5'000'000);
  EXPECT_NEAR(cells[0].drive_rad_per_s[0], 50., 1e-12);
  EXPECT_NEAR(cells[1].drive_rad_per_s[0], -25., 1e-12);
  EXPECT_NEAR(cells[1].steer_rad[0], 0.3, 1e-15);
  EXPECT_NEAR(cells[2].drive_rad_per_s[0], 50., 1e-12);
  EXPECT_EQ(cells[0].n_drive, 1);
  EXPECT_EQ(cells[0].n_steer, 1);
}

TEST(CellsFromAngles, TakeTheMeanSteeringAngleTheShorterWayRound) {
  const auto cells = cells_from_angles(readings(), 0.2);
  EXPECT_NEAR(std::remainder(cells[2].steer_rad[0] - M_PI, 2. * M_PI), 0., 1e-14);
}

TEST(CellsFromAngles, UseEveryNthReadingAndStartAgainBehindAGap) {
  const auto cells = cells_from_angles(readings(), 0.2, 2);
  EXPECT_EQ(cells_of(cells), (Cells{{0, 20'000'000}, {1'000'000'000, 1'030'000'000}}));
  EXPECT_NEAR(cells[0].drive_rad_per_s[0], 12.5, 1e-12);
  EXPECT_NEAR(cells[0].steer_rad[0], 0.2, 1e-15);
  EXPECT_NEAR(cells[1].drive_rad_per_s[0], 1. / 0.03, 1e-12);
  EXPECT_TRUE(cells_from_angles(readings(), 0.2, 3).empty());
}

/// A base that drives, stands for 20 s, of which nothing is written, and drives on: 50 Hz.
std::vector<EncoderReading> written_on_change(bool angles) {
  std::vector<EncoderReading> out;
  double angle = 3.;
  for (int k = 0; k <= 1100; ++k) {
    const double t_s = 0.02 * k;
    const double rate = t_s < 1. ? 10. * (1. - t_s) : t_s > 21. ? 10. * (t_s - 21.) : 0.;
    angle += 0.02 * rate;
    EncoderReading reading;
    reading.t_ns = std::int64_t{k} * 20'000'000;
    reading.n_drive = 1;
    reading.n_steer = 1;
    reading.drive[0] = angles ? angle : rate;
    reading.steer_rad[0] = 0.3;
    if (t_s > 1.001 && t_s < 21.001) continue;
    out.push_back(reading);
  }
  return out;
}

double turned_rad(const std::vector<EncoderSample>& cells) {
  double sum = 0.;
  for (const EncoderSample& cell : cells) {
    sum += cell.drive_rad_per_s[0] * seconds_between(cell.begin_ns, cell.end_ns);
  }
  return sum;
}

TEST(SamplesFrom, ReadingsThatAreWrittenOnChangeStandAsLongAsNothingIsWritten) {
  for (const bool angles : {false, true}) {
    const auto readings = written_on_change(angles);
    const auto cells = samples_from(readings, angles, 0.2, 1);
    for (std::size_t i = 1; i < cells.size(); ++i) {
      ASSERT_EQ(cells[i].begin_ns, cells[i - 1].end_ns) << "a hole";
    }
    EXPECT_NEAR(turned_rad(cells), 10., 0.01);
    EXPECT_NEAR(static_cast<double>(cells.size()), 1100., 3.) << "as who writes always";
    EXPECT_EQ(cells[500].steer_rad[0], 0.3);
  }
}

// Of a few readings close together and long rests between them nobody makes millions.
TEST(SamplesFrom, RestsOfAShortTableStayWithinBounds) {
  std::vector<EncoderReading> readings;
  for (int burst = 0; burst < 300; ++burst) {
    for (int k = 0; k < 3; ++k) {
      EncoderReading reading;
      reading.t_ns = burst * 9'000'000'000L + k * 400'000L;
      reading.n_drive = 2;
      readings.push_back(reading);
    }
  }
  EXPECT_LT(samples_from(readings, false, 0.2, 1).size(), 300'000U);
}

TEST(SamplesFrom, AGapInWhichTheWheelsTurnIsAHole) {
  for (const bool angles : {false, true}) {
    auto readings = written_on_change(angles);
    std::erase_if(readings, [](const EncoderReading& reading) {
      return reading.t_ns > 500'000'000 && reading.t_ns < 21'500'000'000;
    });
    const auto cells = samples_from(readings, angles, 0.2, 1);
    EXPECT_LT(cells.size(), 60U);
  }
  // Nor is it a rest where the wheels are fast at once: readings were lost.
  auto lost = written_on_change(false);
  std::erase_if(lost, [](const EncoderReading& reading) {
    return reading.t_ns > 1'000'000'000 && reading.t_ns < 21'500'000'000;
  });
  EXPECT_LT(samples_from(lost, false, 0.2, 1).size(), 90U);
}

}  // namespace
}  // namespace viwo::log
