"""The BARN navigation benchmark: one robot through clutter of discs, scored by its time.

D. Perille, A. Truong, X. Xiao, P. Stone: Benchmarking Metric Ground Navigation, SSRR 2020; docs/barn.md says what is
the same here and what is not. Worlds come from files of the challenge, which users name; none come with the package.
"""
