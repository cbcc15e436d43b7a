#include "interval.hpp"

namespace viwo::wheel_odometry {

using namespace wheel_motion;

States add_states(const WheelsView& wheels, const FilterView::Covariance& P,
                  const CloneState& first, const CloneState& last, FactorColumns& columns) {
  States states;
  int& n_geometry = states.n_geometry;
  const auto add = [&](int column, int count, int geometry) {
    if (column < 0) return;
    columns.add(column, count);
    for (int i = 0; i < count; ++i) {
      states.geometry[static_cast<std::size_t>(n_geometry++)] = geometry + i;
    }
  };
  add(first.column, kPoseSize, kFirstTheta);
  add(last.column, kPoseSize, kLastTheta);
  add(wheels.extrinsics_column, kPoseSize, kMountTheta);
  add(wheels.time_offset_column, 1, kTimeOffset);
  const auto n = static_cast<int>(wheels.x_WI.size());
  for (const int column : {wheels.intrinsics_column, wheels.wander_column}) {
    if (column >= 0) columns.add(column, n);
  }
  // The prior of just these columns.
  states.P.resize(columns.size(), columns.size());
  int row = 0;
  for (const ColumnRange rows : columns.blocks()) {
    int col = 0;
    for (const ColumnRange cols : columns.blocks()) {
      states.P.block(row, col, rows.count, cols.count) =
          P.block(rows.first, cols.first, rows.count, cols.count);
      col += cols.count;
    }
    row += rows.count;
  }
  // What is constant of the intrinsics and what wanders have the same derivatives: they are one
  // here, their sum.
  if (const int sum = n_geometry + n; row > sum) {
    states.P.middleCols(n_geometry, n) += states.P.rightCols(n);
    states.P.middleRows(n_geometry, n) += states.P.bottomRows(n);
    states.P.conservativeResize(sum, sum);
  }
  for (int i = 0; i < n_geometry; ++i) {
    for (int k = 0; k < n_geometry; ++k) {
      states.geometry_P(states.geometry_at(i), states.geometry_at(k)) = states.P(i, k);
    }
  }
  return states;
}

}  // namespace viwo::wheel_odometry
