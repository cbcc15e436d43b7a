#include "upper_triangular.hpp"

#include <algorithm>

#include <Eigen/Cholesky>

namespace viwo::upper_triangular {
namespace {

using Eigen::Index;

/// Calls `work` with the first column of each panel, the one behind its last, and their number.
template <class Work>
void for_panels(Index size, const Work& work) {
  constexpr Index kPanel = 32;
  for (Index begin = 0; begin < size; begin += kPanel) {
    const Index end = std::min(size, begin + kPanel);
    work(begin, end, end - begin);
  }
}

}  // namespace

bool factorise(Matrix reversed, Matrix C) {
  if (Eigen::LLT<Matrix>(reversed).info() != Eigen::Success) return false;
  C = reversed.reverse();
  C.triangularView<Eigen::StrictlyLower>().setZero();
  return true;
}

void weigh(ConstMatrix C, ConstMatrix Lambda, Matrix work, Matrix T) {
  for_panels(C.cols(), [&](Index begin, Index end, Index count) {
    auto LambdaC = work.block(0, begin, end, count);
    LambdaC.noalias() = Lambda.topLeftCorner(end, end) * C.block(0, begin, end, count);
    T.block(begin, 0, count, end).noalias() =
        LambdaC.transpose() * C.topLeftCorner(end, end).triangularView<Eigen::Upper>();
  });
  T.diagonal().array() += 1.;
}

void divide(Matrix C, ConstMatrix L) {
  for_panels(C.cols(), [&](Index begin, Index end, Index count) {
    auto panel = C.block(0, begin, end, count);
    if (begin > 0) {
      panel.topRows(begin).noalias() -=
          C.topLeftCorner(begin, begin).triangularView<Eigen::Upper>() *
          L.block(begin, 0, count, begin).transpose();
    }
    L.block(begin, begin, count, count)
        .triangularView<Eigen::Lower>()
        .transpose()
        .solveInPlace<Eigen::OnTheRight>(panel);
  });
}

void square(ConstMatrix C, Matrix G) {
  G.triangularView<Eigen::Lower>().setZero();
  for_panels(C.cols(), [&](Index begin, Index end, Index count) {
    G.topLeftCorner(end, end).selfadjointView<Eigen::Lower>().rankUpdate(
        C.block(0, begin, end, count));
  });
}

}  // namespace viwo::upper_triangular
