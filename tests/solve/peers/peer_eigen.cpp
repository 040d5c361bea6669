// SPDX-License-Identifier: MIT
//
// Eigen in the benchmark: conjugate gradients with the diagonal and with an incomplete Cholesky
// factor, and its sparse LDLT. Storage and symbolic analysis are kept, factors are made by each
// solve. The matrix is stored by rows with both halves, which lets Eigen multiply on all threads.

#include "bench.h"

#include <Eigen/Sparse>

#include <vector>

namespace {

using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;
using Vector = Eigen::VectorXd;
constexpr int most_iterations = 50000;
constexpr int most_refinements = 5;

Matrix matrix_of(const bench_system &s) {
    Matrix A(2 * s.n_row, 2 * s.n_row);
    Eigen::VectorXi per_row(2 * s.n_row);
    for (int i = 0; i < 2 * s.n_row; i++)
        per_row[i] = 2 * (s.row_start[i / 2 + 1] - s.row_start[i / 2]);
    A.reserve(per_row);
    for (int i = 0; i < 2 * s.n_row; i++) {
        for (int k = s.row_start[i / 2]; k < s.row_start[i / 2 + 1]; k++) {
            A.insert(i, 2 * s.col[k]) = s.value[4 * (long)k + 2 * (i % 2)];
            A.insert(i, 2 * s.col[k] + 1) = s.value[4 * (long)k + 2 * (i % 2) + 1];
        }
    }
    A.makeCompressed();
    return A;
}

// What all have: the system, and the number of threads it is solved with.
template <class Solver> struct Held {
    Matrix A;
    Vector f, u;
    Solver solver;
    int n_thread;

    Held(const bench_system &s, int threads)
        : A(matrix_of(s)), f(Eigen::Map<const Vector>(s.f, 2 * s.n_row)), u(2 * s.n_row),
          n_thread(threads) {
        Eigen::setNbThreads(n_thread);
        solver.analyzePattern(A);
    }
};

template <class Solver>
void *open_held(const bench_system *system, const bench_method *, int n_thread) {
    return new Held<Solver>(*system, n_thread);
}

template <class Solver> void close_held(void *state) {
    delete static_cast<Held<Solver> *>(state);
}

template <class Solver> int solve_iterative(void *state, double tolerance, double *u) {
    auto &held = *static_cast<Held<Solver> *>(state);
    Eigen::setNbThreads(held.n_thread);
    held.solver.setTolerance(tolerance);
    held.solver.setMaxIterations(most_iterations);
    held.solver.factorize(held.A);
    held.u = held.solver.solve(held.f);
    if (held.solver.info() != Eigen::Success) return -1;
    Eigen::Map<Vector>(u, held.u.size()) = held.u;
    return static_cast<int>(held.solver.iterations());
}

template <class Solver> int solve_direct(void *state, double tolerance, double *u) {
    auto &held = *static_cast<Held<Solver> *>(state);
    held.solver.factorize(held.A);
    if (held.solver.info() != Eigen::Success) return -1;
    const double limit = tolerance * held.f.norm();
    Vector r = held.f;
    held.u.setZero();
    for (int k = 1; k <= most_refinements; k++) {
        held.u += held.solver.solve(r);
        r = held.f - held.A * held.u;
        if (r.norm() > limit) continue;
        Eigen::Map<Vector>(u, held.u.size()) = held.u;
        return k;
    }
    return -1;
}

template <class Solver> bench_method iterative(const char *name) {
    bench_method method = {};
    method.name = name;
    method.family = BENCH_ITERATIVE;
    method.threads = true;
    method.open = open_held<Solver>;
    method.solve = solve_iterative<Solver>;
    method.close = close_held<Solver>;
    return method;
}

template <class Solver> bench_method direct(const char *name, int largest) {
    bench_method method = iterative<Eigen::ConjugateGradient<Matrix>>(name);
    method.family = BENCH_DIRECT;
    method.largest = largest;
    method.threads = false;
    method.open = open_held<Solver>;
    method.solve = solve_direct<Solver>;
    method.close = close_held<Solver>;
    return method;
}

using Diagonal = Eigen::ConjugateGradient<Matrix, Eigen::Lower | Eigen::Upper>;
using Incomplete = Eigen::ConjugateGradient<Matrix, Eigen::Lower | Eigen::Upper,
                                            Eigen::IncompleteCholesky<double>>;
using Factor = Eigen::SimplicialLDLT<Matrix>;

} // namespace

const bench_method *bench_eigen(int *n) {
    static const std::vector<bench_method> list = {iterative<Diagonal>("eigen-cg-diagonal"),
                                                   iterative<Incomplete>("eigen-cg-icc"),
                                                   direct<Factor>("eigen-ldlt", 300000)};
    *n = static_cast<int>(list.size());
    return list.data();
}
