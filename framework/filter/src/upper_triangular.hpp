// What an information update (F-8) does with upper triangular matrices: by panels of columns, which
// end where the triangle ends, it takes half of the work of products that do not know of it.
#pragma once

#include <Eigen/Core>

namespace viwo::upper_triangular {

using Matrix = Eigen::Ref<Eigen::MatrixXd>;
using ConstMatrix = const Eigen::Ref<const Eigen::MatrixXd>&;

/// C of P = C C^T. `reversed`: P with its rows and columns in the opposite order, of which the
/// lower triangle is read; it is used up. False: P is not positive definite.
bool factorise(Matrix reversed, Matrix C);

/// Lower triangle of T = I + C^T Lambda C, of all of Lambda. `work` is as large.
void weigh(ConstMatrix C, ConstMatrix Lambda, Matrix work, Matrix T);

/// C <- C L^-T for a lower triangular L.
void divide(Matrix C, ConstMatrix L);

/// Lower triangle of G = C C^T.
void square(ConstMatrix C, Matrix G);

}  // namespace viwo::upper_triangular
