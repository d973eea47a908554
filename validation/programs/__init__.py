"""What fegear computes, in other programs: their results beside ours.

Every module that compares runs with numpy, the other program and the files that
`export_files` wrote, and needs no fegear.
"""
