"""Renders in slices on many machines: see tools/farm and docs/farm.md.

`plan` is what the processes of a render share: a folder beside the image. `worker` renders a slice or merges a frame, on
any machine. `slurm`, `parallel` and `local` are the engines, which run workers. `status` reads what workers have written.
"""
