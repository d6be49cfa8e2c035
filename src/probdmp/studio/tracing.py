"""placeholder"""
class Tracing:
    """placeholder"""
