#include "correlations.hpp"

#include <cmath>
#include <iterator>
#include <optional>

#include <Eigen/Eigenvalues>

#include "viwo/log/text.hpp"
#include "viwo/math/number_text.hpp"

namespace viwo {
namespace {

using config::Errors;
using config::Node;

/// A row of a correlations matrix has as many numbers as there are rows before it.
bool has_length(const Node::Entry& row, Eigen::Index k, Errors& errors) {
  if (row.value.is_list() && std::ssize(row.value.items()) == k) return true;
  errors.add(row.value.mark(), "correlations." + row.key + ": expected a list of " +
                                   std::to_string(k) +
                                   " numbers, one for each of the rows before it");
  return false;
}

bool read_row(const Node::Entry& row, Eigen::Index k, Eigen::MatrixXd& matrix, Errors& errors) {
  for (Eigen::Index i = 0; i < k; ++i) {
    const Node& item = row.value.items()[static_cast<std::size_t>(i)];
    const auto value = item.is_scalar() ? log::parse_number(item.scalar()) : std::nullopt;
    if (!value || !(std::abs(*value) <= 1.)) {
      errors.add(item.mark(),
                 "correlations." + row.key + ": a correlation is a number from -1 to 1");
      return false;
    }
    matrix(k, i) = matrix(i, k) = *value;
  }
  return true;
}

}  // namespace

PriorCorrelations correlations_in(const Node& rows,
                                  const std::function<bool(const std::string&)>& has_sigma,
                                  Errors& errors) {
  PriorCorrelations out;
  if (!rows.is_map()) {
    errors.add(rows.mark(), "'correlations' is a section with one row per parameter");
    return out;
  }
  const auto n = static_cast<Eigen::Index>(rows.entries().size());
  // All of them before there is a place for n x n.
  for (Eigen::Index k = 0; k < n; ++k) {
    if (!has_length(rows.entries()[static_cast<std::size_t>(k)], k, errors)) return out;
  }
  out.matrix = Eigen::MatrixXd::Identity(n, n);
  for (const Node::Entry& row : rows.entries()) {
    if (!has_sigma(row.key)) {
      errors.add(row.key_mark,
                 "correlations: '" + row.key + "' is none of the parameters that have a sigma");
      return out;
    }
    if (!read_row(row, static_cast<Eigen::Index>(out.entries.size()), out.matrix, errors)) {
      return out;
    }
    out.entries.push_back(row.key);
  }
  if (n == 0) return out;
  // What rounding leaves of directions that are known exactly.
  constexpr double kRounding = 1e-9;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(out.matrix, Eigen::EigenvaluesOnly);
  if (eigen.eigenvalues()[0] < -kRounding) {
    errors.add(rows.mark(),
               "correlations: no such correlations exist (the matrix has a negative "
               "eigenvalue): a number in it is wrong");
  }
  return out;
}

Node correlations_node(const PriorCorrelations& correlations) {
  Node section = Node::empty_map();
  for (std::size_t k = 0; k < correlations.entries.size(); ++k) {
    Node row = Node::list_of();
    for (std::size_t i = 0; i < k; ++i) {
      row.items().push_back(Node::scalar_of(number_text(
          correlations.matrix(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(i)))));
    }
    section.set(correlations.entries[k], row);
  }
  return section;
}

}  // namespace viwo
